#include "offline/mesh/inp_mesh_keywords.hpp"

#include <algorithm>
#include <tuple>

#include "offline/mesh/inp_fields.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// Returns the set of NSET= or ELSET= of a *NODE or *ELEMENT line, or -1.
int set_of(const InpLexer& lexer, const KeywordLine& keyword, const char* parameter, DraftSets& sets) {
  if (keyword.find(parameter) == nullptr) return -1;
  return sets.add(normalised_name(lexer.required_value(keyword, parameter)));
}

// Adds the current members of `other`. Sorting and removing duplicates bounds the size of nested sets.
void include_set(DraftSets& sets, int set, int other) {
  const auto key = [](const LabelRange& range) { return std::tuple(range.first, range.last, range.step); };
  std::vector<LabelRange>& ranges = sets[set].ranges;
  const std::vector<LabelRange>& added = sets[other].ranges;
  ranges.insert(ranges.end(), added.begin(), added.end());
  std::stable_sort(ranges.begin(), ranges.end(),
                   [&](const LabelRange& a, const LabelRange& b) { return key(a) < key(b); });
  const auto same = [&](const LabelRange& a, const LabelRange& b) { return key(a) == key(b); };
  ranges.erase(std::unique(ranges.begin(), ranges.end(), same), ranges.end());
}

void read_generated(const InpLexer& lexer, const DataLine& line, DraftSet& set) {
  const FieldReader fields(lexer, line, 2, 3, "first label, last label, step");
  LabelRange range;
  range.first = fields.label(0, "label");
  range.last = fields.label(1, "label");
  range.step = fields.is_empty(2) ? 1 : fields.integer(2, "step between labels");
  range.place = line.place;
  if (range.last < range.first || range.step <= 0 || (range.last - range.first) % range.step != 0) {
    lexer.fail(line.place, "labels from " + std::to_string(range.first) + " by steps of " +
                               std::to_string(range.step) + " do not arrive at " +
                               std::to_string(range.last) + "; correct first, last or step");
  }
  set.ranges.push_back(range);
}

void read_listed(const InpLexer& lexer, const DataLine& line, const char* kind, DraftSets& sets, int set) {
  const FieldReader fields(lexer, line, 1, line.fields.size(), "labels or set names");
  for (std::size_t i = 0; i < line.fields.size(); ++i) {
    if (fields.is_empty(i)) continue;
    if (is_name(fields.text(i))) {
      const int other = known_set(lexer, sets, kind, fields.text(i), line.place);
      if (other == set)
        lexer.fail(line.place,
                   std::string(kind) + " " + printable(sets[set].name) + " lists itself; remove it");
      include_set(sets, set, other);
    } else {
      const int label = fields.label(i, "label");
      sets[set].ranges.push_back({label, label, 1, line.place});
    }
  }
}

void read_set(InpLexer& lexer, const KeywordLine& keyword, const char* parameter, const char* kind,
              DraftSets& sets) {
  lexer.allow_parameters(keyword, {parameter, "GENERATE"});
  const int set = sets.add(normalised_name(lexer.required_value(keyword, parameter)));
  const bool generate = keyword.find("GENERATE") != nullptr;
  while (const DataLine* line = lexer.next_data()) {
    if (generate) {
      read_generated(lexer, *line, sets[set]);
    } else {
      read_listed(lexer, *line, kind, sets, set);
    }
  }
}

}  // namespace

void read_nodes(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  lexer.allow_parameters(keyword, {"NSET"});
  const int set = set_of(lexer, keyword, "NSET", draft.node_sets);
  while (const DataLine* line = lexer.next_data()) {
    const FieldReader fields(lexer, *line, 4, 4, "a node label and three coordinates");
    DraftNode node;
    node.label = fields.label(0, "node label");
    node.position = {fields.number(1), fields.number(2), fields.number(3)};
    node.place = line->place;
    draft.nodes.push_back(node);
    if (set >= 0) draft.node_sets[set].ranges.push_back({node.label, node.label, 1, node.place});
  }
}

void read_elements(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  lexer.allow_parameters(keyword, {"TYPE", "ELSET"});
  const std::string type = normalised_name(lexer.required_value(keyword, "TYPE"));
  if (type != "C3D4" && type != "C3D10" && type != "C3D10H") {
    lexer.fail(keyword.place,
               "elements of type " + printable(type) +
                   " are not supported; mesh the body with tetrahedra, TYPE=C3D4, C3D10 or C3D10H");
  }
  const int set = set_of(lexer, keyword, "ELSET", draft.element_sets);
  const std::size_t num_nodes = type == "C3D4" ? 4 : 10;
  const std::size_t wanted = 1 + num_nodes;
  // An Abaqus element continues on the next line after a trailing comma.
  std::array<int, 11> numbers = {};
  std::size_t count = 0;
  DraftElement element;
  const char* layout =
      num_nodes == 4 ? "an element label and four node labels" : "an element label and ten node labels";
  while (const DataLine* line = lexer.next_data()) {
    if (count == 0) element.place = line->place;
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
      lexer.fail(line->place, std::string("expected ") + layout + ", found " + std::to_string(count) +
                                  (count == 1 ? " field" : " fields"));
    }
    element.label = numbers[0];
    element.num_nodes = static_cast<int>(num_nodes);
    element.hybrid = type == "C3D10H";
    std::copy_n(numbers.begin() + 1, num_nodes, element.node_labels.begin());
    draft.elements.push_back(element);
    if (set >= 0) draft.element_sets[set].ranges.push_back({element.label, element.label, 1, element.place});
    count = 0;
  }
  if (count > 0) lexer.fail(element.place, std::string("expected ") + layout + ", the element is cut short");
}

void read_node_set(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  read_set(lexer, keyword, "NSET", "node set", draft.node_sets);
}

void read_surface(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  lexer.allow_parameters(keyword, {"NAME", "TYPE"});
  DraftSurface surface;
  surface.name = normalised_name(lexer.required_value(keyword, "NAME"));
  for (const DraftSurface& other : draft.surfaces) {
    if (other.name == surface.name)
      lexer.fail(keyword.place,
                 "surface " + printable(surface.name) + " is already defined; give this one another name");
  }
  if (keyword.find("TYPE") != nullptr) {
    const std::string type = normalised_name(lexer.required_value(keyword, "TYPE"));
    if (type != "ELEMENT")
      lexer.fail(keyword.place, "*SURFACE, TYPE=" + printable(type) +
                                    " is not supported; name faces of elements, TYPE=ELEMENT");
  }
  while (const DataLine* line = lexer.next_data()) {
    const FieldReader fields(lexer, *line, 1, 2,
                             "an element or set, S1 to S4 or nothing for every outer face");
    DraftFaces faces = {fields.element_or_set(0, draft), kOuterFaces, line->place};
    if (!fields.is_empty(1)) {
      const std::string face = normalised_name(fields.text(1));
      if (face.size() != 2 || face[0] != 'S' || face[1] < '1' || face[1] > '4')
        lexer.fail(line->place,
                   "face " + printable(face) + " does not exist in a tetrahedron; write S1, S2, S3 or S4");
      faces.face = face[1] - '1';
    }
    surface.faces.push_back(faces);
  }
  if (surface.faces.empty())
    lexer.fail(keyword.place,
               "surface " + printable(surface.name) + " has no faces; add lines such as SKIN, S1");
  draft.surfaces.push_back(std::move(surface));
}

void read_element_set(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  read_set(lexer, keyword, "ELSET", "element set", draft.element_sets);
}

}  // namespace palpate
