#include "offline/mesh/inp_element_keywords.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "offline/mesh/inp_fields.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

struct ElementType {
  const char* name;
  std::size_t num_nodes;
  bool solid = false;
};

// Elements of lines and surfaces carry load through a section only. Gmsh and others write them to name sets.
constexpr std::array kTypes = {
    ElementType{"C3D4", 4, true}, ElementType{"C3D10", 10, true}, ElementType{"C3D10H", 10, true},
    ElementType{"C3D10M", 10, true},
    // Lines.
    ElementType{"T2D2", 2}, ElementType{"T2D3", 3}, ElementType{"T3D2", 2}, ElementType{"T3D3", 3},
    ElementType{"B21", 2}, ElementType{"B22", 3}, ElementType{"B31", 2}, ElementType{"B31R", 2},
    ElementType{"B32", 3}, ElementType{"B32R", 3}, ElementType{"B33", 2}, ElementType{"R2D2", 2},
    // Triangles.
    ElementType{"CPS3", 3}, ElementType{"CPE3", 3}, ElementType{"CAX3", 3}, ElementType{"S3", 3},
    ElementType{"S3R", 3}, ElementType{"STRI3", 3}, ElementType{"M3D3", 3}, ElementType{"SFM3D3", 3},
    ElementType{"R3D3", 3}, ElementType{"DS3", 3}, ElementType{"CPS6", 6}, ElementType{"CPE6", 6},
    ElementType{"CAX6", 6}, ElementType{"S6", 6}, ElementType{"STRI65", 6}, ElementType{"M3D6", 6},
    ElementType{"SFM3D6", 6}, ElementType{"DS6", 6},
    // Quadrilaterals.
    ElementType{"CPS4", 4}, ElementType{"CPS4R", 4}, ElementType{"CPE4", 4}, ElementType{"CPE4R", 4},
    ElementType{"CAX4", 4}, ElementType{"CAX4R", 4}, ElementType{"S4", 4}, ElementType{"S4R", 4},
    ElementType{"M3D4", 4}, ElementType{"M3D4R", 4}, ElementType{"SFM3D4", 4}, ElementType{"SFM3D4R", 4},
    ElementType{"R3D4", 4}, ElementType{"DS4", 4}, ElementType{"CPS8", 8}, ElementType{"CPS8R", 8},
    ElementType{"CPE8", 8}, ElementType{"CPE8R", 8}, ElementType{"CAX8", 8}, ElementType{"CAX8R", 8},
    ElementType{"S8", 8}, ElementType{"S8R", 8}, ElementType{"M3D8", 8}, ElementType{"M3D8R", 8},
    ElementType{"SFM3D8", 8}, ElementType{"SFM3D8R", 8}, ElementType{"DS8", 8}};

constexpr std::size_t kMostNodes = 10;
constexpr std::array kNumbers = {"no",  "one",   "two",   "three", "four", "five",
                                 "six", "seven", "eight", "nine",  "ten"};

// Whether `type` is `family` with a letter or nothing behind it: C3D8R is of the family C3D8.
bool is_of(std::string_view type, std::string_view family) {
  return type.starts_with(family) &&
         (type.size() == family.size() || type[family.size()] < '0' || type[family.size()] > '9');
}

[[noreturn]] void refuse_type(const InpLexer& lexer, const KeywordLine& keyword, const std::string& type) {
  const char* remedy = "mesh the body with tetrahedra, TYPE=C3D4, C3D10 or C3D10H";
  const auto of_any = [&](std::initializer_list<std::string_view> families) {
    return std::any_of(families.begin(), families.end(),
                       [&](std::string_view family) { return is_of(type, family); });
  };
  if (type == "C3D4H") {
    remedy =
        "write TYPE=C3D4, and MEAN DILATATION in its *SOLID SECTION, which keeps nearly incompressible "
        "tissue "
        "from locking";
  } else if (type == "C3D10MH" || type == "C3D10HS") {
    remedy = "write TYPE=C3D10H";
  } else if (of_any({"C3D8", "C3D20", "C3D27"})) {
    remedy = "these hexahedra become tetrahedra by palpate convert --split";
  } else if (of_any({"C3D6", "C3D15"})) {
    remedy = "these wedges become tetrahedra by palpate convert --split";
  } else if (of_any({"C3D5", "C3D13"})) {
    remedy = "these pyramids become tetrahedra by palpate convert --split";
  }
  lexer.fail(keyword.place,
             fmt::format("elements of type {} are not supported; {}", printable(type), remedy));
}

const ElementType& type_of(const InpLexer& lexer, const KeywordLine& keyword) {
  const std::string name = normalised_name(lexer.required_value(keyword, "TYPE"));
  for (const ElementType& type : kTypes) {
    if (type.name == name) return type;
  }
  refuse_type(lexer, keyword, name);
}

void warn_modified(const InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  if (draft.has_modified) return;
  draft.has_modified = true;
  draft.warnings.emplace_back(
      InputError(lexer.files().at(keyword.place),
                 "elements of type C3D10M are read as C3D10, whose displacements and forces differ a little")
          .what());
}

// The label and the nodes of an element.
using Numbers = std::array<int, 1 + kMostNodes>;

void add_element(const ElementType& type, const Numbers& numbers, Place place, Draft& draft) {
  if (!type.solid) {
    draft.dropped.push_back({numbers[0], type.name, place});
    return;
  }
  DraftElement element;
  element.label = numbers[0];
  element.place = place;
  element.num_nodes = static_cast<int>(type.num_nodes);
  element.hybrid = std::string_view(type.name) == "C3D10H";
  std::copy_n(numbers.begin() + 1, type.num_nodes, element.node_labels.begin());
  draft.elements.push_back(element);
}

}  // namespace

void read_elements(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  lexer.allow_parameters(keyword, {"TYPE", "ELSET"});
  if (draft.assembly.level == DraftAssembly::Level::assembly)
    lexer.fail(keyword.place, "elements of an assembly belong to no instance; move them into a part");
  const ElementType& type = type_of(lexer, keyword);
  if (std::string_view(type.name) == "C3D10M") warn_modified(lexer, keyword, draft);
  int set = -1;
  if (keyword.find("ELSET") != nullptr)
    set = draft.element_sets.add(normalised_name(lexer.required_value(keyword, "ELSET")));
  const std::size_t wanted = 1 + type.num_nodes;
  const std::string layout = fmt::format("an element label and {} node labels", kNumbers[type.num_nodes]);
  // An Abaqus element continues on the next line after a trailing comma.
  Numbers numbers = {};
  std::size_t count = 0;
  Place place;
  while (const DataLine* line = lexer.next_data()) {
    if (count == 0) place = line->place;
    const FieldReader fields(lexer, *line, 1, wanted - count, count == 0 ? layout : "the rest of an element");
    const std::size_t in_line = std::min(line->fields.size(), wanted - count);
    const bool continues = fields.is_empty(in_line - 1);
    const std::size_t used = continues ? in_line - 1 : in_line;
    for (std::size_t i = 0; i < used; ++i) {
      numbers[count] = fields.label(i, count == 0 ? "element label" : "node label");
      ++count;
    }
    if (count < wanted && continues) continue;
    if (count < wanted) {
      lexer.fail(line->place, "expected " + layout + ", found " + std::to_string(count) +
                                  (count == 1 ? " field" : " fields") + "; correct the line");
    }
    if (draft.keeps_mesh) add_element(type, numbers, place, draft);
    if (draft.keeps_mesh && set >= 0)
      draft.element_sets[set].ranges.push_back({numbers[0], numbers[0], 1, place});
    count = 0;
  }
  if (count > 0) lexer.fail(place, "expected " + layout + ", the element is cut short; add its nodes");
}

}  // namespace palpate
