#include "offline/mesh/inp_mesh_keywords.hpp"

#include <algorithm>
#include <tuple>

#include "offline/mesh/inp_fields.hpp"
#include "offline/mesh/inp_passed_over.hpp"
#include "offline/mesh/inp_remedies.hpp"
#include "offline/mesh/nearest_name.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

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

// The instance that a set takes its labels from, or the model itself.
struct Scope {
  std::string instance;  // "" = the model
  int offset = 0;        // of its labels
};

Scope scope_of(const InpLexer& lexer, const KeywordLine& keyword, const Draft& draft) {
  Scope scope;
  if (keyword.find("INSTANCE") == nullptr) return scope;
  scope.instance = normalised_name(lexer.required_value(keyword, "INSTANCE"));
  const auto& offsets = draft.assembly.label_offsets;
  const auto found = offsets.find(scope.instance);
  if (found == offsets.end()) {
    std::vector<std::string> names;
    names.reserve(offsets.size());
    for (const auto& [name, offset] : offsets) names.push_back(name);
    lexer.fail_unknown(keyword.place, scope.instance,
                       "instance " + printable(scope.instance) + " is not defined above this line" +
                           did_you_mean(scope.instance, names, "; define it with *INSTANCE"));
  }
  scope.offset = found->second;
  return scope;
}

// The nodes and elements of an assembly belong to its instances.
void require_scope(const InpLexer& lexer, Place place, const Draft& draft, const Scope& scope) {
  if (draft.assembly.level == DraftAssembly::Level::assembly && scope.instance.empty())
    lexer.fail(place, "a label in an assembly belongs to no instance; add INSTANCE= to the keyword");
}

void read_generated(const InpLexer& lexer, const DataLine& line, const Scope& scope, DraftSet& set) {
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
  range.first = shifted_label(range.first, scope.offset);
  range.last = shifted_label(range.last, scope.offset);
  set.ranges.push_back(range);
}

void read_listed(const InpLexer& lexer, const DataLine& line, const char* kind, const Draft& draft,
                 const Scope& scope, DraftSets& sets, int set) {
  const FieldReader fields(lexer, line, 1, line.fields.size(), "labels or set names");
  for (std::size_t i = 0; i < line.fields.size(); ++i) {
    if (fields.is_empty(i)) continue;
    if (is_name(fields.text(i))) {
      int other = -1;
      if (!scope.instance.empty()) other = sets.find(scope.instance + "." + normalised_name(fields.text(i)));
      if (other < 0) other = known_set(lexer, sets, kind, fields.text(i), line.place);
      if (other == set)
        lexer.fail(line.place,
                   std::string(kind) + " " + printable(sets[set].name) + " lists itself; remove it");
      include_set(sets, set, other);
    } else {
      require_scope(lexer, line.place, draft, scope);
      const int label = shifted_label(fields.label(i, "label"), scope.offset);
      if (draft.keeps_mesh) sets[set].ranges.push_back({label, label, 1, line.place});
    }
  }
}

void read_set(InpLexer& lexer, const KeywordLine& keyword, Draft& draft, const char* parameter,
              const char* kind, DraftSets& sets) {
  allow_parameters(lexer, keyword, draft, {parameter, "GENERATE", "INSTANCE"}, {"INTERNAL", "UNSORTED"});
  const int set = sets.add(normalised_name(lexer.required_value(keyword, parameter)));
  const Scope scope = scope_of(lexer, keyword, draft);
  const bool generate = keyword.find("GENERATE") != nullptr;
  while (const DataLine* line = lexer.next_data()) {
    if (generate) {
      require_scope(lexer, line->place, draft, scope);
      read_generated(lexer, *line, scope, sets[set]);
    } else {
      read_listed(lexer, *line, kind, draft, scope, sets, set);
    }
  }
}

DraftFaces read_faces(const InpLexer& lexer, const DataLine& line, const Draft& draft) {
  const FieldReader fields(lexer, line, 1, 2, "an element or set, S1 to S4 or nothing for every outer face");
  DraftFaces faces = {fields.element_or_set(0, draft), kOuterFaces, line.place};
  if (fields.is_empty(1)) return faces;
  const std::string face = normalised_name(fields.text(1));
  if (face.size() != 2 || face[0] != 'S' || face[1] < '1' || face[1] > '4')
    lexer.fail(line.place,
               "face " + printable(face) + " does not exist in a tetrahedron; write S1, S2, S3 or S4");
  faces.face = face[1] - '1';
  return faces;
}

}  // namespace

void read_nodes(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  lexer.allow_parameters(keyword, {"NSET", "SYSTEM"});
  if (const Parameter* system = keyword.find("SYSTEM")) {
    if (normalised_name(system->value.value_or("")) != "R")
      lexer.fail(keyword.place, "*NODE, SYSTEM is not supported" + parameter_remedy(keyword, *system, {}));
  }
  if (draft.assembly.level == DraftAssembly::Level::assembly) {
    lexer.fail(keyword.place,
               "a node of an assembly, outside of its instances, is a reference point of rigid bodies or "
               "couplings, which are not supported; prescribe displacements of the instances' nodes instead");
  }
  int set = -1;
  if (keyword.find("NSET") != nullptr)
    set = draft.node_sets.add(normalised_name(lexer.required_value(keyword, "NSET")));
  while (const DataLine* line = lexer.next_data()) {
    const FieldReader fields(lexer, *line, 1, 4, "a node label and three coordinates");
    if (line->fields.size() < 4) ++draft.num_short_nodes;
    DraftNode node;
    node.label = fields.label(0, "node label");
    node.position = {fields.number(1), fields.number(2), fields.number(3)};
    node.place = line->place;
    if (!draft.keeps_mesh) continue;
    draft.nodes.push_back(node);
    if (set >= 0) draft.node_sets[set].ranges.push_back({node.label, node.label, 1, node.place});
  }
}

void read_node_set(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  read_set(lexer, keyword, draft, "NSET", "node set", draft.node_sets);
}

void read_surface(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  allow_parameters(lexer, keyword, draft, {"NAME", "TYPE"}, {"INTERNAL"});
  DraftSurface surface;
  surface.name = normalised_name(lexer.required_value(keyword, "NAME"));
  for (const DraftSurface& other : draft.surfaces) {
    if (other.name == surface.name)
      lexer.fail(keyword.place,
                 "surface " + printable(surface.name) + " is already defined; give this one another name");
  }
  if (keyword.find("TYPE") != nullptr) {
    const std::string type = normalised_name(lexer.required_value(keyword, "TYPE"));
    surface.of_nodes = type == "NODE";
    if (type != "ELEMENT" && type != "NODE")
      lexer.fail(keyword.place, "*SURFACE, TYPE=" + printable(type) +
                                    " is not supported; name faces of elements, TYPE=ELEMENT");
  }
  bool empty = true;
  while (const DataLine* line = lexer.next_data()) {
    empty = false;
    if (surface.of_nodes) {
      const FieldReader fields(lexer, *line, 1, 2, "a node or set, and its area");
      surface.nodes.push_back({fields.node_or_set(0, draft), line->place});
    } else {
      surface.faces.push_back(read_faces(lexer, *line, draft));
    }
  }
  if (empty)
    lexer.fail(keyword.place, "surface " + printable(surface.name) +
                                  (surface.of_nodes ? " has no nodes; add lines such as SKIN"
                                                    : " has no faces; add lines such as SKIN, S1"));
  draft.surfaces.push_back(std::move(surface));
}

void read_element_set(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  read_set(lexer, keyword, draft, "ELSET", "element set", draft.element_sets);
}

}  // namespace palpate
