#include "offline/mesh/inp_resolve_steps.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "offline/mesh/element_faces.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// Magnitude and amplitude of a load at a place, which is the key in a map.
template <typename Value>
struct Scaled {
  Value value;
  int amplitude = kRamp;
};
using NodeAxis = std::pair<int, int>;

// The loads that act in a step. A step begins with the loads of the step before.
struct ActingLoads {
  std::map<NodeAxis, Scaled<double>> prescribed;
  std::map<NodeAxis, std::vector<Scaled<double>>> forces;  // forces at one place add up
  std::map<int, Scaled<Eigen::Vector3d>> gravity;          // by element
  // Separate for *DLOAD and *DSLOAD: OP=NEW of one keyword keeps the loads of the other.
  std::map<FaceId, Scaled<double>> dload_pressures;
  std::map<FaceId, Scaled<double>> dsload_pressures;
  std::map<FaceId, Scaled<Eigen::Vector3d>> tractions;

  template <typename Visitor>
  void for_each(Visitor&& visit) {
    for (auto& [where, load] : prescribed) visit(load);
    for (auto& [where, loads] : forces) {
      for (auto& load : loads) visit(load);
    }
    for (auto& [where, load] : gravity) visit(load);
    for (auto& [where, load] : dload_pressures) visit(load);
    for (auto& [where, load] : dsload_pressures) visit(load);
    for (auto& [where, load] : tractions) visit(load);
  }
};

class StepResolver {
 public:
  StepResolver(const Draft& draft, const SourceFiles& files,
               const std::vector<std::pair<int, int>>& element_index, Model& model)
      : draft_(draft), files_(files), element_index_(element_index), model_(model) {
    used_.assign(model.positions.size(), 0);
    for (const Tetrahedron& element : model.elements) {
      for (const int node : element.nodes()) used_[static_cast<std::size_t>(node)] = 1;
    }
  }

  void run() {
    model_.amplitudes = draft_.amplitudes;
    prescribe(draft_.fixed);
    for (const auto& [where, held] : acting_.prescribed)
      model_.fixed.push_back({where.first, where.second, held.value});
    for (const DraftStep& step : draft_.steps) resolve_step(step);
  }

 private:
  [[noreturn]] void fail(Place place, const std::string& message) const {
    throw InputError(files_.at(place), message);
  }
  std::string node_label(int node) const {
    return std::to_string(model_.labels[static_cast<std::size_t>(node)]);
  }
  std::string element_label(int element) const {
    return std::to_string(model_.elements[static_cast<std::size_t>(element)].label);
  }

  std::vector<int> nodes(const DraftTarget& target, Place place, const char* keyword) const {
    if (target.set < 0) {
      const int node = model_.find_node(target.label);
      if (node < 0) {
        fail(place, std::string(keyword) + " names node " + std::to_string(target.label) +
                        ", which is not defined; define it with *NODE");
      }
      return {node};
    }
    const std::string& name = draft_.node_sets.all()[static_cast<std::size_t>(target.set)].name;
    return not_empty(model_.node_sets.at(name), place, keyword, "node", name);
  }

  std::vector<int> elements(const DraftTarget& target, Place place, const char* keyword) const {
    if (target.set < 0) {
      const auto found =
          std::lower_bound(element_index_.begin(), element_index_.end(), std::pair(target.label, 0));
      if (found == element_index_.end() || found->first != target.label) {
        fail(place, std::string(keyword) + " names element " + std::to_string(target.label) +
                        ", which is not defined; define it with *ELEMENT");
      }
      return {found->second};
    }
    const std::string& name = draft_.element_sets.all()[static_cast<std::size_t>(target.set)].name;
    return not_empty(model_.element_sets.at(name), place, keyword, "element", name);
  }

  const std::vector<int>& not_empty(const std::vector<int>& members, Place place, const char* keyword,
                                    const char* item, const std::string& set) const {
    if (members.empty()) {
      fail(place, std::string(keyword) + " acts on " + item + " set " + printable(set) +
                      ", which is empty; add " + item + "s to it");
    }
    return members;
  }

  // Returns the faces of a line; all of them must be outer faces.
  std::vector<FaceId> faces(const DraftFaces& named, const char* keyword) {
    if (is_outer_.empty()) find_outer_faces();
    std::vector<FaceId> found;
    for (const int element : elements(named.elements, named.place, keyword)) {
      for (int face = 0; face < 4; ++face) {
        const bool outer = is_outer_[static_cast<std::size_t>(4 * element + face)] != 0;
        if (named.face == kOuterFaces ? outer : named.face == face) found.push_back({element, face});
        if (named.face == face && !outer) {
          fail(named.place, std::string(keyword) + " names face " + std::to_string(face + 1) +
                                " of element " + element_label(element) +
                                ", which another element shares; only outer faces can be loaded");
        }
      }
    }
    return found;
  }

  void find_outer_faces() {
    is_outer_.assign(4 * model_.elements.size(), 1);
    const std::vector<ElementFace> sorted = sorted_faces(model_);
    for (std::size_t i = 1; i < sorted.size(); ++i) {
      if (sorted[i].sorted != sorted[i - 1].sorted) continue;
      for (const ElementFace& face : {sorted[i - 1], sorted[i]})
        is_outer_[static_cast<std::size_t>(4 * face.element + face.face)] = 0;
    }
  }

  template <typename Value>
  std::vector<FaceId> loaded_faces(const DraftFaceLoad<Value>& load) {
    if (load.surface < 0) return faces(load.faces, "*DLOAD");
    std::vector<FaceId> all;
    for (const DraftFaces& named : draft_.surfaces[static_cast<std::size_t>(load.surface)].faces) {
      const std::vector<FaceId> line_faces = faces(named, "*SURFACE");
      all.insert(all.end(), line_faces.begin(), line_faces.end());
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }

  // Adds `load` to the loads `given` by this step, and refuses a different load at the same place. `where()`
  // describes the place in messages.
  template <typename Key, typename Value, typename Where>
  void add_load(std::map<Key, Scaled<Value>>& given, const Key& key, const Scaled<Value>& load, Place place,
                const char* what, Where&& where) const {
    const auto [known, is_new] = given.try_emplace(key, load);
    if (is_new || (known->second.value == load.value && known->second.amplitude == load.amplitude)) return;
    fail(place, fmt::format("conflicting {} {} in one step; keep one", what, where()));
  }

  // Overwrites acting loads at the places of given loads.
  template <typename Map>
  static void replace(Map& acting, const Map& given) {
    for (const auto& [where, load] : given) acting[where] = load;
  }

  // Returns the displacement that *BOUNDARY, FIXED keeps: the value at the start of the step. `before`: the
  // values of the step before.
  double kept_value(const std::map<NodeAxis, Scaled<double>>& before, const NodeAxis& where,
                    Place place) const {
    if (model_.steps.empty()) return 0;
    const auto found = before.find(where);
    if (found == before.end()) {
      fail(place,
           fmt::format("*BOUNDARY, FIXED keeps node {} along {} where the step before leaves it, which "
                       "only the solve finds; write the displacement, without FIXED",
                       node_label(where.first), "xyz"[where.second]));
    }
    const Scaled<double>& held = found->second;
    if (held.amplitude == kRamp) return held.value;
    const Step& last = model_.steps.back();
    return held.value *
           model_.amplitudes[static_cast<std::size_t>(held.amplitude)].at(last.start_time + last.period);
  }

  void prescribe(const std::vector<DraftDisplacement>& drafts,
                 const std::map<NodeAxis, Scaled<double>>& before = {}) {
    std::map<NodeAxis, Scaled<double>> given;
    for (const DraftDisplacement& draft : drafts) {
      for (const int node : nodes(draft.target, draft.place, "*BOUNDARY")) {
        for (int axis = draft.first_axis; axis <= draft.last_axis; ++axis) {
          Scaled<double> load = {draft.value, draft.amplitude};
          if (draft.keeps) load = {kept_value(before, {node, axis}, draft.place), kRamp};
          add_load(given, {node, axis}, load, draft.place, "displacements of node",
                   [&] { return node_label(node) + " along " + "xyz"[axis]; });
        }
      }
    }
    replace(acting_.prescribed, given);
  }

  // As in CalculiX, forces at a node and axis add up within a step and replace the forces of the step before.
  void apply_forces(const std::vector<DraftForce>& drafts) {
    std::map<NodeAxis, std::vector<Scaled<double>>> given;
    for (const DraftForce& draft : drafts) {
      for (const int node : nodes(draft.target, draft.place, "*CLOAD")) {
        if (used_[static_cast<std::size_t>(node)] == 0) {
          fail(draft.place,
               "*CLOAD acts on node " + node_label(node) + ", which belongs to no element; load another");
        }
        std::vector<Scaled<double>>& loads = given[{node, draft.axis}];
        const auto alike = std::find_if(loads.begin(), loads.end(), [&](const Scaled<double>& load) {
          return load.amplitude == draft.amplitude;
        });
        if (alike == loads.end()) {
          loads.push_back({draft.value, draft.amplitude});
        } else {
          alike->value += draft.value;
        }
      }
    }
    replace(acting_.forces, given);
  }

  void apply_gravity(const std::vector<DraftGravity>& drafts) {
    std::map<int, Scaled<Eigen::Vector3d>> given;
    for (const DraftGravity& draft : drafts) {
      const bool everywhere = draft.elements.set < 0 && draft.elements.label == 0;
      std::vector<int> pulled;
      if (everywhere) {
        for (std::size_t element = 0; element < model_.elements.size(); ++element)
          pulled.push_back(static_cast<int>(element));
      } else {
        pulled = elements(draft.elements, draft.place, "*DLOAD");
      }
      for (const int element : pulled) {
        const int material = model_.elements[static_cast<std::size_t>(element)].material;
        if (material < 0) continue;  // only in a file that is read for a report
        if (model_.materials[static_cast<std::size_t>(material)].density == 0) {
          fail(draft.place, "gravity pulls at element " + element_label(element) + ", whose material " +
                                printable(model_.materials[static_cast<std::size_t>(material)].name) +
                                " has no mass; add *DENSITY below *MATERIAL");
        }
        add_load(given, element, {draft.value, draft.amplitude}, draft.place, "gravity at element",
                 [&] { return element_label(element); });
      }
    }
    replace(acting_.gravity, given);
  }

  template <typename Value>
  void apply_to_faces(const std::vector<DraftFaceLoad<Value>>& drafts, bool of_surfaces, const char* what,
                      std::map<FaceId, Scaled<Value>>& acting) {
    std::map<FaceId, Scaled<Value>> given;
    for (const DraftFaceLoad<Value>& draft : drafts) {
      if ((draft.surface >= 0) != of_surfaces) continue;
      for (const FaceId& face : loaded_faces(draft)) {
        add_load(given, face, {draft.value, draft.amplitude}, draft.place, what, [&] {
          return std::to_string(face.face + 1) + " of element " + element_label(face.element);
        });
      }
    }
    replace(acting, given);
  }

  // A load with a history in step time keeps its last value in later steps.
  void end_step_amplitudes(double period) {
    acting_.for_each([&](auto& load) {
      if (load.amplitude == kRamp) return;
      const Amplitude& amplitude = model_.amplitudes[static_cast<std::size_t>(load.amplitude)];
      if (amplitude.total_time) return;
      load.value *= amplitude.at(period);
      load.amplitude = kRamp;
    });
  }

  // One factor scales all changes of the step, so no change may have its own history.
  ArcLengthControl resolve_riks(const DraftStep& draft) {
    bool changes =
        draft.boundary_op.is_new || draft.cload_op.is_new || draft.dload_op.is_new || draft.dsload_op.is_new;
    const auto check_changes = [&](const auto& loads) {
      for (const auto& load : loads) {
        changes = true;
        if (load.amplitude != kRamp)
          fail(load.place, "*STATIC, RIKS finds the factor of its loads itself; remove AMPLITUDE");
      }
    };
    check_changes(draft.prescribed);
    check_changes(draft.forces);
    check_changes(draft.gravity);
    check_changes(draft.pressures);
    check_changes(draft.tractions);
    if (!changes) {
      fail(draft.riks->place,
           "*STATIC, RIKS has no path to follow, as its step changes no load and moves nothing; add *CLOAD, "
           "*DLOAD, *DSLOAD or *BOUNDARY");
    }
    acting_.for_each([&](const auto& load) {
      if (load.amplitude == kRamp) return;
      fail(draft.riks->place,
           "a load of an earlier step goes on in total time by amplitude " +
               printable(model_.amplitudes[static_cast<std::size_t>(load.amplitude)].name) +
               ", but *STATIC, RIKS has no time; write that amplitude in step time");
    });
    ArcLengthControl control = draft.riks->control;
    if (draft.riks->node_label != 0)
      control.node = nodes({draft.riks->node_label}, draft.riks->data_place, "*STATIC, RIKS").front();
    for (const DraftRiks::Watched& watched : draft.riks->watched) {
      const std::vector<int> members = nodes({0, watched.set}, watched.place, "the request");
      control.watched.insert(control.watched.end(), members.begin(), members.end());
    }
    std::sort(control.watched.begin(), control.watched.end());
    control.watched.erase(std::unique(control.watched.begin(), control.watched.end()), control.watched.end());
    return control;
  }

  void resolve_step(const DraftStep& draft) {
    const bool keeps = std::any_of(draft.prescribed.begin(), draft.prescribed.end(),
                                   [](const DraftDisplacement& given) { return given.keeps; });
    std::map<NodeAxis, Scaled<double>> before;
    if (keeps) before = acting_.prescribed;
    if (draft.boundary_op.is_new) acting_.prescribed.clear();
    if (draft.cload_op.is_new) acting_.forces.clear();
    if (draft.dload_op.is_new) {
      acting_.gravity.clear();
      acting_.dload_pressures.clear();
    }
    if (draft.dsload_op.is_new) {
      acting_.dsload_pressures.clear();
      acting_.tractions.clear();
    }
    prescribe(draft.prescribed, before);
    apply_forces(draft.forces);
    apply_gravity(draft.gravity);
    apply_to_faces(draft.pressures, false, "pressures on face", acting_.dload_pressures);
    apply_to_faces(draft.pressures, true, "pressures on face", acting_.dsload_pressures);
    apply_to_faces(draft.tractions, true, "tractions on face", acting_.tractions);

    Step step = draft.step;
    if (draft.riks) step.riks = resolve_riks(draft);
    step.source = files_.at(draft.place);
    if (!model_.steps.empty()) step.start_time = model_.steps.back().start_time + model_.steps.back().period;
    for (const auto& [where, load] : acting_.prescribed)
      step.prescribed.push_back({where.first, where.second, load.value, load.amplitude});
    for (const auto& [where, loads] : acting_.forces) {
      for (const auto& load : loads)
        step.forces.push_back({where.first, where.second, load.value, load.amplitude});
    }
    for (const auto* pressures : {&acting_.dload_pressures, &acting_.dsload_pressures}) {
      for (const auto& [face, load] : *pressures)
        step.pressures.push_back({face, load.value, load.amplitude});
    }
    std::stable_sort(step.pressures.begin(), step.pressures.end(),
                     [](const FacePressure& a, const FacePressure& b) { return a.face < b.face; });
    for (const auto& [face, load] : acting_.tractions)
      step.tractions.push_back({face, load.value, load.amplitude});
    for (const auto& [element, load] : acting_.gravity)
      step.gravity.push_back({element, load.value, load.amplitude});
    end_step_amplitudes(step.period);
    model_.steps.push_back(std::move(step));
  }

  const Draft& draft_;
  const SourceFiles& files_;
  const std::vector<std::pair<int, int>>& element_index_;
  Model& model_;
  std::vector<char> used_;      // whether an element has the node
  std::vector<char> is_outer_;  // for each face of each element; empty until needed
  ActingLoads acting_;
};

}  // namespace

void resolve_steps(const Draft& draft, const SourceFiles& files,
                   const std::vector<std::pair<int, int>>& element_index, Model& model) {
  StepResolver(draft, files, element_index, model).run();
}

}  // namespace palpate
