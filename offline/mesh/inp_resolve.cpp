#include "offline/mesh/inp_resolve.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "offline/mesh/inp_resolve_steps.hpp"
#include "offline/mesh/inp_ties.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/merge_nodes.hpp"
#include "offline/mesh/model_check.hpp"
#include "offline/mesh/nearest_name.hpp"
#include "offline/mesh/text_number.hpp"
#include "offline/mesh/volume_patches.hpp"

namespace palpate {
namespace {

// Returns sorted pairs (label, index); refuses the second place of a repeated label.
template <typename Item>
std::vector<std::pair<int, int>> index_labels(const std::vector<Item>& items, const SourceFiles& files,
                                              const char* kind) {
  std::vector<std::pair<int, int>> index;
  index.reserve(items.size());
  for (const Item& item : items) index.emplace_back(item.label, static_cast<int>(index.size()));
  std::sort(index.begin(), index.end());
  for (std::size_t i = 1; i < index.size(); ++i) {
    if (index[i].first != index[i - 1].first) continue;
    const Item& first = items[static_cast<std::size_t>(index[i - 1].second)];
    const Item& second = items[static_cast<std::size_t>(index[i].second)];
    throw InputError(files.at(second.place), std::string(kind) + " " + std::to_string(second.label) +
                                                 " is already defined at " + location(files.at(first.place)) +
                                                 "; give one of them another label");
  }
  return index;
}

// Returns the index of the item with this label, or -1.
int find_label(const std::vector<std::pair<int, int>>& index, int label) {
  const auto found = std::lower_bound(index.begin(), index.end(), std::pair(label, 0));
  return found != index.end() && found->first == label ? found->second : -1;
}

class Resolver {
 public:
  Resolver(const Draft& draft, const SourceFiles& files, const std::string& file)
      : draft_(draft), files_(files) {
    model_.file = file;
    model_.files = files_.names();
    model_.warnings = draft.warnings;
  }

  Model run_mesh() {
    resolve_nodes();
    resolve_elements();
    join_ties(draft_, files_, element_index_, model_);
    warn_dropped();
    return std::move(model_);
  }

  Model run_unchecked(double merge_length) {
    resolve_all(merge_length, true);
    return std::move(model_);
  }

  Model run(double merge_length) {
    resolve_all(merge_length, false);
    check_model(model_, origin_);
    return std::move(model_);
  }

 private:
  [[noreturn]] void fail(Place place, const std::string& message) const {
    throw InputError(files_.at(place), message);
  }

  // `may_lack_materials`: elements without a section get the material -1.
  void resolve_all(double merge_length, bool may_lack_materials) {
    resolve_nodes();
    resolve_elements();
    join_ties(draft_, files_, element_index_, model_);
    if (merge_length > 0) merge_nodes(model_, merge_length, origin_);
    resolve_materials();
    const std::vector<int> sections = resolve_sections();
    if (!may_lack_materials) refuse_bare_elements(sections);
    refuse_dropped();
    warn_dropped();
    resolve_steps(draft_, files_, element_index_, model_);
    form_volume_patches(model_, volume_groups_);
  }

  void resolve_nodes() {
    model_.label_index = index_labels(draft_.nodes, files_, "node");
    for (const DraftNode& node : draft_.nodes) {
      model_.labels.push_back(node.label);
      model_.positions.push_back(node.position);
    }
    for (const DraftSet& set : draft_.node_sets.all()) {
      model_.node_sets[set.name] = members(set, model_.label_index, "node set ", "node", "*NODE");
    }
  }

  void resolve_elements() {
    element_index_ = index_labels(draft_.elements, files_, "element");
    for (const DraftElement& draft : draft_.elements) {
      Tetrahedron element;
      element.label = draft.label;
      element.num_nodes = draft.num_nodes;
      for (std::size_t i = 0; i < element.nodes().size(); ++i) {
        const int found = model_.find_node(draft.node_labels[i]);
        if (found < 0) {
          fail(draft.place, "element " + std::to_string(draft.label) + " names node " +
                                std::to_string(draft.node_labels[i]) +
                                ", which is not defined; define it with *NODE");
        }
        element.node_array[i] = found;
      }
      model_.elements.push_back(element);
      origin_.elements.push_back(draft.place);
    }
    origin_.files = files_;
    index_dropped();
    for (const DraftSet& set : draft_.element_sets.all()) {
      dropped_member_.push_back(-1);
      model_.element_sets[set.name] = members(set, element_index_, "element set ", "element", "*ELEMENT");
    }
  }

  void index_dropped() {
    dropped_index_ = index_labels(draft_.dropped, files_, "element");
    for (const DraftDropped& element : draft_.dropped) {
      const int same = find_label(element_index_, element.label);
      if (same < 0) continue;
      fail(element.place, "element " + std::to_string(element.label) + " is already defined at " +
                              location(files_.at(origin_.elements[static_cast<std::size_t>(same)])) +
                              "; give one of them another label");
    }
  }

  // Refuses elements of lines and surfaces that a section, surface or load refers to.
  void refuse_dropped() const {
    for (const DraftSection& section : draft_.sections)
      refuse_dropped({0, section.element_set}, section.place, "*SOLID SECTION");
    for (const DraftSurface& surface : draft_.surfaces) {
      for (const DraftFaces& faces : surface.faces) refuse_dropped(faces.elements, faces.place, "*SURFACE");
    }
    for (const DraftStep& step : draft_.steps) {
      for (const DraftGravity& gravity : step.gravity)
        refuse_dropped(gravity.elements, gravity.place, "*DLOAD");
      for (const auto& pressure : step.pressures) {
        if (pressure.surface < 0) refuse_dropped(pressure.faces.elements, pressure.place, "*DLOAD");
      }
    }
  }

  void refuse_dropped(const DraftTarget& target, Place place, const char* keyword) const {
    const int found = target.set >= 0 ? dropped_member_[static_cast<std::size_t>(target.set)]
                                      : find_label(dropped_index_, target.label);
    if (found < 0) return;
    const DraftDropped& element = draft_.dropped[static_cast<std::size_t>(found)];
    fail(place, std::string(keyword) + " refers to element " + std::to_string(element.label) + " of type " +
                    element.type +
                    ", which is no tetrahedron; take it out, and mesh the body with tetrahedra");
  }

  void warn_dropped() {
    std::map<std::string, int> counts;
    for (const DraftDropped& element : draft_.dropped) ++counts[element.type];
    std::string shown;
    for (const auto& [type, count] : counts)
      shown += (shown.empty() ? "" : ", ") + std::to_string(count) + " of type " + type;
    if (shown.empty()) return;
    if (model_.elements.empty()) {
      fail(draft_.dropped.front().place, "the model has elements of lines and surfaces alone (" + shown +
                                             "); mesh its inside with tetrahedra, TYPE=C3D4");
    }
    model_.warnings.push_back(model_.file +
                              ": dropped elements, as they are no solids and no section, surface or load "
                              "refers to them: " +
                              shown);
  }

  // Returns the sorted members of a set. Stops at the first undefined label: a huge range needs no memory.
  // Notes that the last element set has a dropped element.
  std::vector<int> members(const DraftSet& set, const std::vector<std::pair<int, int>>& index,
                           const char* kind, const char* item, const char* keyword) {
    const bool of_elements = &index == &element_index_;
    std::vector<int> found;
    for (const LabelRange& range : set.ranges) {
      const std::int64_t last = range.last;
      for (std::int64_t label = range.first; label <= last; label += range.step) {
        const int member = find_label(index, static_cast<int>(label));
        const int dropped =
            member < 0 && of_elements ? find_label(dropped_index_, static_cast<int>(label)) : -1;
        if (dropped >= 0) {
          dropped_member_.back() = dropped;
          continue;
        }
        if (member < 0) {
          fail(range.place, kind + printable(set.name) + " names " + item + " " + std::to_string(label) +
                                ", which is not defined; define it with " + keyword);
        }
        found.push_back(member);
      }
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  void resolve_materials() {
    for (const DraftMaterial& material : draft_.materials) {
      if (!material.has_law) {
        fail(material.place, "material " + printable(material.material.name) +
                                 " has no law; add *HYPERELASTIC or *ELASTIC below it");
      }
      model_.materials.push_back(material.material);
      Law& law = model_.materials.back().law;
      const auto* elastic = std::get_if<LinearElastic>(&law);
      if (elastic == nullptr && !draft_.steps.empty() && !draft_.steps.front().nlgeom) {
        fail(draft_.steps.front().place,
             "*STEP without NLGEOM asks for small strain, which the hyperelastic material " +
                 printable(material.material.name) + " does not know; write *STEP, NLGEOM");
      }
      if (elastic != nullptr && !draft_.steps.empty() && draft_.steps.front().nlgeom)
        law = StVenantKirchhoff{elastic->mu, elastic->lambda};
    }
  }

  int material(const DraftSection& section) const {
    std::vector<std::string> names;
    for (const Material& material : model_.materials) {
      if (material.name == section.material) return static_cast<int>(names.size());
      names.push_back(material.name);
    }
    fail(section.place, "material " + printable(section.material) + " is not defined" +
                            did_you_mean(section.material, names, "; define it with *MATERIAL"));
  }

  // Returns the section of each element, or -1.
  std::vector<int> resolve_sections() {
    std::vector<int> section_of(model_.elements.size(), -1);
    for (Tetrahedron& element : model_.elements) element.material = -1;
    volume_groups_.assign(model_.elements.size(), -1);
    int number = 0;
    for (const DraftSection& section : draft_.sections) {
      const int section_material = material(section);
      const auto set = static_cast<std::size_t>(section.element_set);
      for (const int element : model_.element_sets.at(draft_.element_sets.all()[set].name)) {
        int& taken = section_of[static_cast<std::size_t>(element)];
        Tetrahedron& tetrahedron = model_.elements[static_cast<std::size_t>(element)];
        if (taken >= 0) {
          const Place other = draft_.sections[static_cast<std::size_t>(taken)].place;
          fail(section.place, "element " + std::to_string(tetrahedron.label) +
                                  " is already in the section of " + location(files_.at(other)) +
                                  "; take it out of one of them");
        }
        taken = number;
        tetrahedron.material = section_material;
        const bool hybrid = draft_.elements[static_cast<std::size_t>(element)].hybrid;
        if (section.mean_dilatation && tetrahedron.num_nodes == 10)
          fail(section.place, "MEAN DILATATION is for elements of four nodes, and element " +
                                  std::to_string(tetrahedron.label) +
                                  " has ten; give its *ELEMENT TYPE=C3D10H and leave MEAN DILATATION out");
        if (section.mean_dilatation || hybrid) volume_groups_[static_cast<std::size_t>(element)] = number;
      }
      ++number;
    }
    return section_of;
  }

  void refuse_bare_elements(const std::vector<int>& section_of) const {
    const auto missing = std::find(section_of.begin(), section_of.end(), -1);
    if (missing != section_of.end()) {
      const auto element = static_cast<std::size_t>(missing - section_of.begin());
      fail(origin_.elements[element],
           "element " + std::to_string(model_.elements[element].label) +
               " has no material; add *SOLID SECTION for an element set that holds it");
    }
  }

  const Draft& draft_;
  const SourceFiles& files_;
  Model model_;
  ModelOrigin origin_;
  std::vector<std::pair<int, int>> element_index_;  // (label, index), sorted
  std::vector<std::pair<int, int>> dropped_index_;  // (label, index in Draft::dropped), sorted
  std::vector<int> dropped_member_;  // for each element set: one of its dropped elements, or -1
  std::vector<int> volume_groups_;   // for each element: its section if the section shares volumes, else -1
};

}  // namespace

Model resolve(const Draft& draft, const SourceFiles& files, const std::string& file, double merge_length) {
  return Resolver(draft, files, file).run(merge_length);
}

Model resolve_unchecked(const Draft& draft, const SourceFiles& files, const std::string& file,
                        double merge_length) {
  return Resolver(draft, files, file).run_unchecked(merge_length);
}

Model resolve_mesh(const Draft& draft, const SourceFiles& files, const std::string& file) {
  return Resolver(draft, files, file).run_mesh();
}

}  // namespace palpate
