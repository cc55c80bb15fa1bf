#include "offline/io/vtk_attributes.hpp"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cstdint>

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

int hexadecimal_digit(char letter) {
  if (letter >= '0' && letter <= '9') return letter - '0';
  if (letter >= 'a' && letter <= 'f') return letter - 'a' + 10;
  if (letter >= 'A' && letter <= 'F') return letter - 'A' + 10;
  return -1;
}

}  // namespace

std::string upper_case(std::string_view text) {
  std::string upper(text);
  for (char& letter : upper) letter = static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
  return upper;
}

std::string decoded_vtk_name(std::string_view name) {
  std::string decoded;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool is_code = name[i] == '%' && i + 2 < name.size() && hexadecimal_digit(name[i + 1]) >= 0 &&
                         hexadecimal_digit(name[i + 2]) >= 0;
    if (!is_code) {
      decoded += name[i];
      continue;
    }
    decoded += static_cast<char>(16 * hexadecimal_digit(name[i + 1]) + hexadecimal_digit(name[i + 2]));
    i += 2;
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

bool VtkAttributes::read(const std::string& keyword, std::size_t size, std::vector<MeshArray>& arrays) {
  for (const FixedAttribute& attribute : kFixedAttributes) {
    if (attribute.keyword != keyword) continue;
    MeshArray array = {next_name(), attribute.num_components, {}};
    const NumberType type = next_type();
    end_header();
    array.values = next_values(size * static_cast<std::size_t>(array.num_components), type, array.name);
    arrays.push_back(std::move(array));
    return true;
  }
  if (keyword == "SCALARS") {
    read_scalars(size, arrays);
  } else if (keyword == "COLOR_SCALARS") {
    read_colours(size, arrays);
  } else if (keyword == "TEXTURE_COORDINATES") {
    MeshArray array = {next_name(), next_num_components("the dimension of texture coordinates"), {}};
    const NumberType type = next_type();
    end_header();
    array.values = next_values(size * static_cast<std::size_t>(array.num_components), type, array.name);
    arrays.push_back(std::move(array));
  } else if (keyword == "FIELD") {
    read_field(arrays);
  } else if (keyword == "LOOKUP_TABLE") {
    skip_lookup_table();
  } else {
    return false;
  }
  return true;
}

// SCALARS name type [components]     LOOKUP_TABLE name     values
void VtkAttributes::read_scalars(std::size_t size, std::vector<MeshArray>& arrays) {
  MeshArray array = {next_name(), 1, {}};
  const NumberType type = next_type();
  const std::string_view rest = trimmed(cursor_.next_line("the values"));
  if (!rest.empty()) {
    const std::optional<int> components = parse_integer(rest);
    if (!components || *components < 1 || *components > kMaxComponents)
      cursor_.fail("'" + printable(rest) + "' is no number of components; export the file again");
    array.num_components = *components;
  }
  if (upper_case(cursor_.peek_word()) != "LOOKUP_TABLE")
    cursor_.fail("LOOKUP_TABLE is missing behind SCALARS; export the file again");
  cursor_.next_line("LOOKUP_TABLE");
  array.values = next_values(size * static_cast<std::size_t>(array.num_components), type, array.name);
  arrays.push_back(std::move(array));
}

// COLOR_SCALARS name components     bytes in a binary file, fractions in text
void VtkAttributes::read_colours(std::size_t size, std::vector<MeshArray>& arrays) {
  MeshArray array = {next_name(), next_num_components("the number of colours"), {}};
  end_header();
  array.values =
      next_values(size * static_cast<std::size_t>(array.num_components), NumberType::uint8, array.name);
  arrays.push_back(std::move(array));
}

// FIELD name arrays     for each array: name components tuples type     values
void VtkAttributes::read_field(std::vector<MeshArray>& arrays) {
  cursor_.next_word("the name of a field");
  const std::size_t count = cursor_.next_count("the number of arrays", 1);
  for (std::size_t i = 0; i < count; ++i) {
    if (upper_case(cursor_.peek_word()) == "METADATA") {
      cursor_.next_word("METADATA");
      skip_metadata();
    }
    MeshArray array = {next_name(), 1, {}};
    const int components = cursor_.next_integer("the number of components");
    if (components < 0 || components > kMaxComponents)
      cursor_.fail("the number of components is out of range; export the file again");
    array.num_components = components;
    const std::size_t tuples = cursor_.next_count("the number of values", 0);
    const std::size_t num_values = tuples * static_cast<std::size_t>(components);
    const std::string type = upper_case(cursor_.peek_word());
    if (type == "STRING" || type == "BIT") {
      cursor_.next_word("a type");
      end_header();
      type == "STRING" ? skip_strings(num_values) : skip_bits(num_values);
      continue;
    }
    const NumberType number = next_type();
    end_header();
    array.values = next_values(num_values, number, array.name);
    if (components > 0) arrays.push_back(std::move(array));
  }
}

// LOOKUP_TABLE name size     red, green, blue, alpha
void VtkAttributes::skip_lookup_table() {
  const std::string name = next_name();
  const std::size_t count = cursor_.next_count("the size of a lookup table", 4);
  end_header();
  next_values(4 * count, NumberType::uint8, name);
}

void VtkAttributes::skip_bits(std::size_t count) {
  if (coding_ == NumberCoding::text) {
    next_values(count, NumberType::uint8, "bits");
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

NumberType VtkAttributes::next_type() {
  const std::string_view word = cursor_.next_word("a type of numbers");
  const std::optional<NumberType> type = number_type(word);
  if (!type) cursor_.fail("'" + printable(word) + "' is no type of numbers; write int, float or double");
  return *type;
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

std::vector<double> VtkAttributes::next_values(std::size_t count, NumberType type, const std::string& name) {
  const std::string what = "array '" + printable(name) + "'";
  return next_numbers(cursor_, count, type, coding_, what.c_str());
}

}  // namespace palpate
