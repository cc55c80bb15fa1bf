#include "offline/io/vtk_attributes.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <utility>

#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

struct FixedAttribute {
  std::string_view keyword;
  int num_components;
};

constexpr auto kFixedAttributes = std::to_array<FixedAttribute>({
    {"VECTORS", 3},
    {"NORMALS", 3},
    {"TENSORS", 9},
    {"TENSORS6", 6},
    {"GLOBAL_IDS", 1},
    {"PEDIGREE_IDS", 1},
    {"EDGE_FLAGS", 1},
});

}  // namespace

std::string decoded_vtk_name(std::string_view name) {
  std::string decoded;
  decoded.reserve(name.size());
  for (std::size_t i = 0; i < name.size(); ++i) {
    unsigned char code = 0;
    const char* digits = name.data() + i + 1;
    if (name[i] == '%' && i + 2 < name.size() &&
        std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2) {
      decoded += static_cast<char>(code);
      i += 2;
    } else {
      decoded += name[i];
    }
  }
  return decoded;
}

std::string encoded_vtk_name(std::string_view name) {
  std::string encoded;
  for (const char letter : name) {
    const auto code = static_cast<unsigned char>(letter);
    if (code <= 32 || code >= 127 || letter == '"' || letter == '%') {
      encoded += fmt::format("%{:02X}", code);
    } else {
      encoded += letter;
    }
  }
  return encoded;
}

bool VtkAttributes::read(const std::string& keyword, std::size_t num_rows, const Take& take) {
  for (const FixedAttribute& attribute : kFixedAttributes) {
    if (attribute.keyword != keyword) continue;
    std::string name = next_name();
    const NumberType type = next_type(cursor_);
    end_header();
    read_array(std::move(name), attribute.num_components, num_rows, type, take);
    return true;
  }
  if (keyword == "SCALARS") {
    read_scalars(num_rows, take);
  } else if (keyword == "COLOR_SCALARS" || keyword == "TEXTURE_COORDINATES") {
    // Colours are bytes in a binary file, fractions in text, and state no type.
    std::string name = next_name();
    const int num_components = next_num_components("the number of components");
    const NumberType type = keyword == "COLOR_SCALARS" ? NumberType::uint8 : next_type(cursor_);
    end_header();
    read_array(std::move(name), num_components, num_rows, type, take);
  } else if (keyword == "FIELD") {
    read_field(take);
  } else if (keyword == "LOOKUP_TABLE") {
    skip_lookup_table();
  } else {
    return false;
  }
  return true;
}

void VtkAttributes::read_array(std::string name, int num_components, std::size_t num_rows, NumberType type,
                               const Take& take) {
  const std::string what = "array '" + printable(name) + "'";
  const std::size_t count = num_rows * static_cast<std::size_t>(num_components);
  check_room(cursor_, count, type, coding_, what.c_str());
  MeshArray array = {std::move(name), num_components, {}};
  if (keeps_) array.values.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double value = next_number(cursor_, type, coding_, what.c_str());
    if (keeps_) array.values.push_back(value);
  }
  if (take && num_components > 0) take(std::move(array), num_rows);
}

// SCALARS name type [components]     LOOKUP_TABLE name     values
void VtkAttributes::read_scalars(std::size_t num_rows, const Take& take) {
  std::string name = next_name();
  const NumberType type = next_type(cursor_);
  const std::string_view rest = trimmed(cursor_.next_line("the values"));
  const std::optional<int> components = rest.empty() ? 1 : parse_integer(rest);
  if (!components || *components < 1 || *components > kMaxComponents)
    cursor_.fail("'" + printable(rest) + "' is no number of components; export the file again");
  if (upper_case(cursor_.peek_word()) != "LOOKUP_TABLE")
    cursor_.fail("LOOKUP_TABLE is missing behind SCALARS; export the file again");
  cursor_.next_line("LOOKUP_TABLE");
  read_array(std::move(name), *components, num_rows, type, take);
}

// FIELD name arrays     for each array: name components tuples type     values
void VtkAttributes::read_field(const Take& take) {
  cursor_.next_word("the name of a field");
  const std::size_t count = cursor_.next_count("the number of arrays", 1);
  for (std::size_t i = 0; i < count; ++i) {
    if (upper_case(cursor_.peek_word()) == "METADATA") {
      cursor_.next_word("METADATA");
      skip_metadata();
    }
    std::string name = next_name();
    const int components = cursor_.next_integer("the number of components");
    if (components < 0 || components > kMaxComponents)
      cursor_.fail("the number of components is out of range; export the file again");
    const std::size_t tuples = cursor_.next_count("the number of values", 0);
    const std::size_t num_values = tuples * static_cast<std::size_t>(components);
    const std::string type = upper_case(cursor_.peek_word());
    if (type == "STRING" || type == "BIT") {
      cursor_.next_word("a type");
      end_header();
      type == "STRING" ? skip_strings(num_values) : skip_bits(num_values);
      continue;
    }
    const NumberType number = next_type(cursor_);
    end_header();
    read_array(std::move(name), components, tuples, number, take);
  }
}

// LOOKUP_TABLE name size     red, green, blue, alpha
void VtkAttributes::skip_lookup_table() {
  std::string name = next_name();
  const std::size_t count = cursor_.next_count("the size of a lookup table", 4);
  end_header();
  read_array(std::move(name), 4, count, NumberType::uint8, {});
}

void VtkAttributes::skip_bits(std::size_t count) {
  if (coding_ == NumberCoding::text) {
    read_array("bits", 1, count, NumberType::uint8, {});
  } else {
    cursor_.next_bytes((count + 7) / 8, "an array of bits");
  }
}

// In text a line each. In binary the two highest bits of the first byte tell how many bytes the length takes:
// 8, 4, 2 or 1.
void VtkAttributes::skip_strings(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    if (coding_ == NumberCoding::text) {
      cursor_.next_line("a text");
      continue;
    }
    const auto first = cursor_.next_binary<std::uint8_t>(true, "a text");
    std::size_t length = first & 0x3f;
    const int num_more = (8 >> (first >> 6)) - 1;
    for (int byte = 0; byte < num_more; ++byte)
      length = length << 8 | cursor_.next_binary<std::uint8_t>(true, "a text");
    cursor_.next_bytes(length, "a text");
  }
}

void VtkAttributes::skip_metadata() {
  end_header();
  while (!cursor_.at_end() && !trimmed(cursor_.next_line("metadata")).empty()) {
  }
}

void VtkAttributes::end_header() {
  if (cursor_.at_end()) return;
  const std::string_view rest = trimmed(cursor_.next_line("the values"));
  if (!rest.empty())
    cursor_.fail_at(cursor_.line() - 1,
                    "'" + printable(rest) + "' stands where the line should end; export the file again");
}

std::string VtkAttributes::next_name() {
  return decoded_vtk_name(cursor_.next_word("the name of an array"));
}

int VtkAttributes::next_num_components(const char* what) {
  const int count = cursor_.next_integer(what);
  if (count < 1 || count > kMaxComponents)
    cursor_.fail(std::string(what) + " is out of range; export the file again");
  return count;
}

}  // namespace palpate
