#include "offline/mesh/inp_part_keywords.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

#include "offline/mesh/inp_fields.hpp"
#include "offline/mesh/nearest_name.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

using Level = DraftAssembly::Level;

// A model has a few million nodes and elements. The bound keeps a short file with many instances of a large
// part from filling the memory.
constexpr std::size_t kMostCopied = 5'000'000;

DraftMesh& mesh_of(Draft& draft) {
  return draft;
}

// Opens a level; a part or an instance begins with an empty mesh. Refuses another level than `expected`
// around it: that level then ends, and its part or instance is lost.
void open_level(const InpLexer& lexer, const KeywordLine& keyword, Draft& draft, Level expected,
                Level opened) {
  DraftAssembly& assembly = draft.assembly;
  const Level level = assembly.level;
  const std::string before = assembly.keyword;
  const int line = assembly.place.line;
  if (assembly.in_part()) mesh_of(draft) = std::exchange(assembly.outer, {});
  assembly.level = opened;
  assembly.keyword = keyword.shown;
  assembly.place = keyword.place;
  assembly.name.clear();
  if (assembly.in_part()) assembly.outer = std::exchange(mesh_of(draft), {});
  if (level == expected) return;
  if (expected == Level::assembly && level == Level::model) {
    lexer.fail_following(keyword.place, keyword.shown +
                                            " stands outside of an assembly; move it between *ASSEMBLY and "
                                            "*END ASSEMBLY");
  }
  lexer.fail_following(keyword.place, fmt::format("{} inside the {} of line {}; end that one with *END {}",
                                                  keyword.shown, before, line, before.substr(1)));
}

// Returns to the level around. Refuses the end of a level that is not open.
void close_level(const InpLexer& lexer, const KeywordLine& keyword, DraftAssembly& assembly, Level closed,
                 Level around) {
  const Level level = assembly.level;
  if (level == closed) {
    assembly.level = around;
    assembly.keyword = "*ASSEMBLY";
    return;
  }
  if (level == Level::model) {
    lexer.fail_following(
        keyword.place, fmt::format("{} ends nothing, as no such keyword is open; remove it", keyword.shown));
  }
  lexer.fail_following(
      keyword.place,
      fmt::format("{} inside the {} of line {}; end that one with *END {} first", keyword.shown,
                  assembly.keyword, assembly.place.line, assembly.keyword.substr(1)));
}

// Counts the items that an instance copies; a long name counts as several items.
std::size_t num_items(const DraftMesh& mesh) {
  const auto size = [](const std::string& name) { return 1 + name.size() / 64; };
  std::size_t items = mesh.nodes.size() + mesh.elements.size() + mesh.dropped.size();
  for (const DraftSection& section : mesh.sections) items += size(section.material);
  for (const DraftSets* sets : {&mesh.node_sets, &mesh.element_sets}) {
    for (const DraftSet& set : sets->all()) items += size(set.name) + set.ranges.size();
  }
  for (const DraftSurface& surface : mesh.surfaces)
    items += size(surface.name) + surface.faces.size() + surface.nodes.size();
  return items;
}

int largest_label(const DraftMesh& mesh) {
  int largest = 0;
  for (const DraftNode& node : mesh.nodes) largest = std::max(largest, node.label);
  for (const DraftElement& element : mesh.elements) largest = std::max(largest, element.label);
  for (const DraftDropped& element : mesh.dropped) largest = std::max(largest, element.label);
  return largest;
}

// Returns the offset of an instance whose largest label is `largest`, behind `taken`: a round number, so that
// the digits of its labels stay.
std::int64_t label_offset(int largest, int taken) {
  if (taken == 0) return 0;
  std::int64_t unit = 10;
  while (unit <= largest) unit *= 10;
  return (taken + unit - 1) / unit * unit;
}

// Copies the sets of an instance with its prefix. Returns the new index of each set.
std::vector<int> append_sets(DraftSets& sets, const DraftSets& added, const std::string& prefix, int offset,
                             DraftAssembly::Names& names) {
  std::vector<int> index;
  for (const DraftSet& set : added.all()) {
    const int to = sets.add(prefix + set.name);
    index.push_back(to);
    for (LabelRange range : set.ranges) {
      range.first = shifted_label(range.first, offset);
      range.last = shifted_label(range.last, offset);
      sets[to].ranges.push_back(range);
    }
    auto& [count, last] = names[set.name];
    ++count;
    last = to;
  }
  return index;
}

void shift(DraftTarget& target, const std::vector<int>& sets, int offset) {
  if (target.set >= 0) {
    target.set = sets[static_cast<std::size_t>(target.set)];
  } else {
    target.label = shifted_label(target.label, offset);
  }
}

void append(Draft& draft, const DraftMesh& mesh, int offset) {
  const std::string prefix = draft.assembly.name + ".";
  const std::optional<DraftPose>& pose = draft.assembly.pose;
  for (DraftNode node : mesh.nodes) {
    node.label += offset;
    if (pose) node.position = pose->turn * (node.position + pose->shift - pose->centre) + pose->centre;
    draft.nodes.push_back(node);
  }
  for (DraftElement element : mesh.elements) {
    element.label += offset;
    for (int i = 0; i < element.num_nodes; ++i) {
      int& label = element.node_labels[static_cast<std::size_t>(i)];
      label = shifted_label(label, offset);
    }
    draft.elements.push_back(element);
  }
  for (DraftDropped element : mesh.dropped) {
    element.label += offset;
    draft.dropped.push_back(element);
  }
  const std::vector<int> node_sets =
      append_sets(draft.node_sets, mesh.node_sets, prefix, offset, draft.assembly.node_sets);
  const std::vector<int> element_sets =
      append_sets(draft.element_sets, mesh.element_sets, prefix, offset, draft.assembly.element_sets);
  for (DraftSection section : mesh.sections) {
    section.element_set = element_sets[static_cast<std::size_t>(section.element_set)];
    draft.sections.push_back(std::move(section));
  }
  for (DraftSurface surface : mesh.surfaces) {
    auto& [count, last] = draft.assembly.surfaces[surface.name];
    ++count;
    last = static_cast<int>(draft.surfaces.size());
    surface.name = prefix + surface.name;
    for (DraftFaces& faces : surface.faces) shift(faces.elements, element_sets, offset);
    for (DraftSurfaceNodes& named : surface.nodes) shift(named.nodes, node_sets, offset);
    draft.surfaces.push_back(std::move(surface));
  }
}

// Gives each set that one instance has a second name without the instance, unless the assembly has the name.
void add_short_names(DraftSets& sets, const DraftAssembly::Names& names) {
  for (const auto& [name, counted] : names) {
    if (counted.first != 1 || sets.find(name) >= 0) continue;
    const int set = sets.add(name);
    sets[set].ranges = sets[counted.second].ranges;
  }
}

// Reads the shift, and the turn x -> R (x - a) + a about the axis from a to b.
void read_pose(InpLexer& lexer, DraftAssembly& assembly) {
  assembly.pose.reset();
  const DataLine* line = lexer.next_data();
  if (line == nullptr) return;
  DraftPose& pose = assembly.pose.emplace();
  const FieldReader shift(lexer, *line, 1, 3, "the shift along x, y, z");
  pose.shift = {shift.number(0), shift.number(1), shift.number(2)};
  line = lexer.next_data();
  if (line == nullptr) return;
  const FieldReader turn(lexer, *line, 7, 7, "two points of the axis and the angle in degrees");
  pose.centre = {turn.number(0), turn.number(1), turn.number(2)};
  const Eigen::Vector3d axis = Eigen::Vector3d(turn.number(3), turn.number(4), turn.number(5)) - pose.centre;
  const double length = axis.stableNorm();
  if (!(length > 0)) lexer.fail(line->place, "the two points of the axis are the same; correct one of them");
  const double angle = turn.number(6) * std::numbers::pi / 180;
  pose.turn = Eigen::AngleAxisd(angle, axis / length).toRotationMatrix();
}

}  // namespace

void read_part(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  DraftAssembly& assembly = draft.assembly;
  open_level(lexer, keyword, draft, Level::model, Level::part);
  lexer.allow_parameters(keyword, {"NAME"});
  assembly.name = normalised_name(lexer.required_value(keyword, "NAME"));
  if (assembly.parts.count(assembly.name) > 0) {
    lexer.fail(keyword.place,
               "part " + printable(assembly.name) + " is already defined; give this one another name");
  }
}

void read_end_part(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  close_level(lexer, keyword, draft.assembly, Level::part, Level::model);
  draft.assembly.parts.try_emplace(draft.assembly.name, std::move(mesh_of(draft)));
  mesh_of(draft) = std::exchange(draft.assembly.outer, {});
  lexer.allow_parameters(keyword, {});
}

void read_assembly(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  open_level(lexer, keyword, draft, Level::model, Level::assembly);
  lexer.allow_parameters(keyword, {"NAME"});
  if (!draft.assembly.label_offsets.empty())
    lexer.fail(keyword.place,
               "a model has one assembly, and this is the second; write all instances into one");
}

void read_instance(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  DraftAssembly& assembly = draft.assembly;
  open_level(lexer, keyword, draft, Level::assembly, Level::instance);
  lexer.allow_parameters(keyword, {"NAME", "PART"});
  assembly.name = normalised_name(lexer.required_value(keyword, "NAME"));
  if (assembly.label_offsets.count(assembly.name) > 0) {
    lexer.fail(keyword.place,
               "instance " + printable(assembly.name) + " is already defined; give this one another name");
  }
  const std::string part = normalised_name(lexer.required_value(keyword, "PART"));
  const auto found = assembly.parts.find(part);
  if (found == assembly.parts.end()) {
    std::vector<std::string> names;
    for (const auto& [name, mesh] : assembly.parts) names.push_back(name);
    lexer.fail_unknown(keyword.place, part,
                       "part " + printable(part) + " is not defined above this line" +
                           did_you_mean(part, names, "; define it with *PART"));
  }
  assembly.num_copied += num_items(found->second);
  if (assembly.num_copied > kMostCopied) {
    lexer.fail(keyword.place, fmt::format("the instances have together more than {} nodes and elements, the "
                                          "limit; leave some of them out",
                                          kMostCopied));
  }
  mesh_of(draft) = found->second;
  read_pose(lexer, assembly);
}

void read_end_instance(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  DraftAssembly& assembly = draft.assembly;
  close_level(lexer, keyword, assembly, Level::instance, Level::assembly);
  const DraftMesh mesh = std::exchange(mesh_of(draft), std::exchange(assembly.outer, {}));
  lexer.allow_parameters(keyword, {});
  const int largest = largest_label(mesh);
  const std::int64_t offset = label_offset(largest, assembly.largest_label);
  if (offset + largest >= std::numeric_limits<int>::max()) {
    lexer.fail(keyword.place,
               fmt::format("the labels of instance {} do not fit behind {}, the largest label before; "
                           "number the nodes and elements of its part from 1",
                           printable(assembly.name), assembly.largest_label));
  }
  if (offset > 0 && largest > 0)
    assembly.shifted.push_back(fmt::format("{} by {}", printable(assembly.name), offset));
  assembly.label_offsets[assembly.name] = static_cast<int>(offset);
  append(draft, mesh, static_cast<int>(offset));
  assembly.largest_label = std::max(assembly.largest_label, static_cast<int>(offset) + largest);
}

void read_end_assembly(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  DraftAssembly& assembly = draft.assembly;
  close_level(lexer, keyword, assembly, Level::assembly, Level::model);
  lexer.allow_parameters(keyword, {});
  add_short_names(draft.node_sets, assembly.node_sets);
  add_short_names(draft.element_sets, assembly.element_sets);
  for (const auto& named : assembly.surfaces) {
    const std::string& name = named.first;
    const auto [count, last] = named.second;
    if (count != 1) continue;
    const bool taken = std::any_of(draft.surfaces.begin(), draft.surfaces.end(),
                                   [&](const DraftSurface& surface) { return surface.name == name; });
    if (taken) continue;
    draft.surfaces.push_back(draft.surfaces[static_cast<std::size_t>(last)]);
    draft.surfaces.back().name = name;
  }
  assembly.parts.clear();
}

std::string shifted_labels_warning(const Draft& draft) {
  constexpr std::size_t kShown = 20;
  std::string shown;
  const std::vector<std::string>& shifted = draft.assembly.shifted;
  for (std::size_t i = 0; i < shifted.size() && i < kShown; ++i)
    shown += (shown.empty() ? "" : ", ") + shifted[i];
  if (shifted.size() > kShown) shown += fmt::format(" and {} more", shifted.size() - kShown);
  if (shown.empty()) return "";
  return "labels of instances after the first are shifted, as they must differ: " + shown;
}

}  // namespace palpate
