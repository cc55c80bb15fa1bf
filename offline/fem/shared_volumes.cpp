#include "offline/fem/shared_volumes.hpp"

#include <algorithm>
#include <map>

#include "offline/material/volume_split.hpp"
#include "offline/mesh/tetrahedron_shape.hpp"

namespace palpate {
namespace {

template <int kNodes>
double reference_volume(const Model& model, const Tetrahedron& element) {
  typename TetrahedronShape<kNodes>::Nodal positions;
  for (int a = 0; a < kNodes; ++a)
    positions.col(a) =
        model.positions[static_cast<std::size_t>(element.node_array[static_cast<std::size_t>(a)])];
  double volume = 0;
  for (int point = 0; point < TetrahedronShape<kNodes>::kPoints; ++point)
    volume += ShapeAtPoint<kNodes>(positions, point).volume;
  return volume;
}

}  // namespace

SharedVolumes::SharedVolumes(const Model& model) : model_(&model), patch_of_(model.elements.size(), -1) {
  std::map<int, std::vector<int>> patches;
  for (std::size_t e = 0; e < model.elements.size(); ++e) {
    if (model.elements[e].volume_patch >= 0)
      patches[model.elements[e].volume_patch].push_back(static_cast<int>(e));
  }
  element_starts_ = node_starts_ = {0};
  for (const auto& [number, elements] : patches) {
    std::vector<int> nodes;
    double volume = 0;
    for (const int e : elements) {
      const Tetrahedron& element = model.elements[static_cast<std::size_t>(e)];
      patch_of_[static_cast<std::size_t>(e)] = num_patches();
      nodes.insert(nodes.end(), element.nodes().begin(), element.nodes().end());
      volume +=
          element.num_nodes == 4 ? reference_volume<4>(model, element) : reference_volume<10>(model, element);
    }
    std::ranges::sort(nodes);
    nodes_.insert(nodes_.end(), nodes.begin(), std::unique(nodes.begin(), nodes.end()));
    elements_.insert(elements_.end(), elements.begin(), elements.end());
    element_starts_.push_back(elements_.size());
    node_starts_.push_back(nodes_.size());
    volumes_.push_back(volume);
  }
}

std::span<const int> SharedVolumes::nodes(int patch) const {
  const auto p = static_cast<std::size_t>(patch);
  return std::span(nodes_).subspan(node_starts_[p], node_starts_[p + 1] - node_starts_[p]);
}

SharedVolumes::State SharedVolumes::begin(bool with_gradients) const {
  State state;
  if (empty()) return state;
  state.volumes.assign(patch_of_.size(), 0.0);
  if (with_gradients) state.gradients.resize(patch_of_.size());
  return state;
}

void SharedVolumes::finish(State& state) const {
  for (std::size_t p = 0; p < volumes_.size(); ++p) {
    double volume = 0;
    for (std::size_t i = element_starts_[p]; i < element_starts_[p + 1]; ++i)
      volume += state.volumes[static_cast<std::size_t>(elements_[i])];
    const auto first = static_cast<std::size_t>(elements_[element_starts_[p]]);
    const auto material = static_cast<std::size_t>(model_->elements[first].material);
    const VolumeTerm term = volume_term(model_->materials[material].law, volume / volumes_[p]);
    state.pressures.push_back(term.pressure);
    state.stiffnesses.push_back(term.stiffness);
    state.energy += volumes_[p] * term.energy;
  }
}

void SharedVolumes::gradient(const State& state, int patch, std::vector<double>& gradient) const {
  const std::span<const int> patch_nodes = nodes(patch);
  gradient.assign(3 * patch_nodes.size(), 0.0);
  const auto p = static_cast<std::size_t>(patch);
  for (std::size_t i = element_starts_[p]; i < element_starts_[p + 1]; ++i) {
    const auto e = static_cast<std::size_t>(elements_[i]);
    const std::span<const int> element_nodes = model_->elements[e].nodes();
    for (std::size_t a = 0; a < element_nodes.size(); ++a) {
      const auto place = static_cast<std::size_t>(std::ranges::lower_bound(patch_nodes, element_nodes[a]) -
                                                  patch_nodes.begin());
      for (std::size_t axis = 0; axis < 3; ++axis)
        gradient[3 * place + axis] += state.gradients[e][3 * a + axis];
    }
  }
}

double SharedVolumes::dyad_scale(const State& state, int patch) const {
  const auto p = static_cast<std::size_t>(patch);
  return state.stiffnesses[p] / volumes_[p];
}

}  // namespace palpate
