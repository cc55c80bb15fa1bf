#include "offline/fem/assembly.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "offline/fem/parallel_for.hpp"
#include "offline/material/constitutive_response.hpp"
#include "offline/material/volume_split.hpp"

// Builds equations, sparsity pattern and batches of elements. element_loops.cpp computes forces and tangents.
namespace palpate {
namespace {

// With this order successive elements write to neighbouring entries of the stiffness.
std::vector<size_t> elements_by_smallest_node(const Model& model, int num_nodes) {
  std::vector<size_t> order;
  for (size_t e = 0; e < model.elements.size(); ++e) {
    if (model.elements[e].num_nodes == num_nodes) order.push_back(e);
  }
  const auto smallest_node = [&](size_t e) { return std::ranges::min(model.elements[e].nodes()); };
  std::ranges::stable_sort(order, {}, smallest_node);
  return order;
}

// Puts element `e` into the next lane of a batch and repeats the element in the later lanes.
template <typename Batch, typename Shapes>
void append_element(int e, const Tetrahedron& element, const Shapes& shapes, Batch& batch) {
  for (int lane = batch.num_elements++; lane < kLanes; ++lane) {
    batch.elements[static_cast<size_t>(lane)] = e;
    batch.materials[static_cast<size_t>(lane)] = element.material;
    for (size_t a = 0; a < batch.nodes.size(); ++a) {
      batch.nodes[a][static_cast<size_t>(lane)] = element.node_array[a];
      for (size_t p = 0; p < shapes.size(); ++p) {
        batch.points[p].volume.set(lane, shapes[p].volume);
        for (size_t axis = 0; axis < 3; ++axis)
          batch.points[p].gradients[a][axis].set(
              lane, shapes[p].gradients(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(a)));
      }
    }
  }
}

}  // namespace

// Divides the nodes into slabs of equal counts across the longest side of the body.
void Assembly::divide_nodes(int parts) {
  parts_.resize(static_cast<size_t>(parts));
  node_part_.assign(static_cast<size_t>(model_->num_nodes()), 0);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& position : model_->positions) box.extend(position);
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  std::vector<int> order(node_part_.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const double at_a = model_->positions[static_cast<size_t>(a)][axis];
    const double at_b = model_->positions[static_cast<size_t>(b)][axis];
    return std::pair(at_a, a) < std::pair(at_b, b);
  });
  for (size_t rank = 0; rank < order.size(); ++rank)
    node_part_[static_cast<size_t>(order[rank])] =
        static_cast<int>(rank * static_cast<size_t>(parts) / order.size());
}

Assembly::Assembly(const Model& model, const std::vector<char>& eliminated, int threads)
    : model_(&model), volumes_(model), threads_(std::max(1, threads)) {
  for (const Material& material : model.materials)
    laws_without_volume_.push_back(without_volume_term(material.law));
  std::vector<char> has_element(static_cast<size_t>(model.num_nodes()), 0);
  for (const Tetrahedron& element : model.elements) {
    for (const int node : element.nodes()) has_element[static_cast<size_t>(node)] = 1;
  }
  constexpr size_t kWorthAThread = 2000;  // elements; their work far exceeds the start of a thread
  divide_nodes(static_cast<int>(
      std::clamp<size_t>(model.elements.size() / kWorthAThread, 1, static_cast<size_t>(threads_))));
  dof_equations_.assign(static_cast<size_t>(model.num_dofs()), -1);
  for (int dof = 0; dof < model.num_dofs(); ++dof) {
    if (eliminated[static_cast<size_t>(dof)] || !has_element[static_cast<size_t>(dof / 3)]) continue;
    dof_equations_[static_cast<size_t>(dof)] = static_cast<int>(equation_dofs_.size());
    equation_dofs_.push_back(dof);
  }

  set_pattern();
  make_batches<4>();
  make_batches<10>();
  place_patches();
}

int Assembly::first_equation(int node) const {
  for (int axis = 0; axis < 3; ++axis) {
    const int equation = dof_equations_[static_cast<size_t>(3 * node + axis)];
    if (equation >= 0) return equation;
  }
  return -1;
}

void Assembly::set_pattern() {
  // A group is a set of coupled nodes: the nodes of an element or of a volume patch.
  std::vector<std::span<const int>> groups;
  for (size_t e = 0; e < model_->elements.size(); ++e) {
    if (volumes_.patch_of(static_cast<int>(e)) < 0) groups.push_back(model_->elements[e].nodes());
  }
  for (int patch = 0; patch < volumes_.num_patches(); ++patch) groups.push_back(volumes_.nodes(patch));
  std::vector<int> first_group(static_cast<size_t>(model_->num_nodes()) + 1, 0);
  for (const std::span<const int> group : groups) {
    for (const int node : group) ++first_group[static_cast<size_t>(node) + 1];
  }
  std::partial_sum(first_group.begin(), first_group.end(), first_group.begin());
  std::vector<int> groups_of(static_cast<size_t>(first_group.back()));  // sorted by node
  std::vector<int> next = first_group;
  for (size_t g = 0; g < groups.size(); ++g) {
    for (const int node : groups[g])
      groups_of[static_cast<size_t>(next[static_cast<size_t>(node)]++)] = static_cast<int>(g);
  }

  std::vector<int> starts = {0};
  std::vector<int> rows;
  // A node and its coupled nodes of larger number; the columns of the node store their rows.
  std::vector<int> coupled;
  std::vector<int> coupled_to(static_cast<size_t>(model_->num_nodes()), -1);  // last node that lists a node
  for (int node = 0; node < model_->num_nodes(); ++node) {
    if (first_equation(node) < 0) continue;
    coupled.clear();
    for (int i = first_group[static_cast<size_t>(node)]; i < first_group[static_cast<size_t>(node) + 1];
         ++i) {
      for (const int other : groups[static_cast<size_t>(groups_of[static_cast<size_t>(i)])]) {
        if (other < node || coupled_to[static_cast<size_t>(other)] == node) continue;
        coupled_to[static_cast<size_t>(other)] = node;
        coupled.push_back(other);
      }
    }
    std::sort(coupled.begin(), coupled.end());
    for (int axis = 0; axis < 3; ++axis) {
      const int column = dof_equations_[static_cast<size_t>(3 * node + axis)];
      if (column < 0) continue;
      for (const int other : coupled) {
        for (int row_axis = 0; row_axis < 3; ++row_axis) {
          const int row = dof_equations_[static_cast<size_t>(3 * other + row_axis)];
          if (row >= column) rows.push_back(row);
        }
      }
      starts.push_back(static_cast<int>(rows.size()));
    }
  }
  std::vector<double> values(rows.size(), 0.0);
  pattern_ =
      Eigen::Map<const SparseLower>(num_equations(), num_equations(), static_cast<Eigen::Index>(rows.size()),
                                    starts.data(), rows.data(), values.data());
}

// Groups the elements of each part into batches of one kind. Sums the factors of rounding_force().
template <int kNodes>
void Assembly::make_batches() {
  std::vector<double> moduli;
  for (const Material& material : model_->materials)
    moduli.push_back(
        stress_and_tangent(material.law, Eigen::Matrix3d::Identity()).tangent.cwiseAbs().maxCoeff());
  const auto batches_of = [&](size_t part) -> Batches<kNodes>& {
    if constexpr (kNodes == 4) return parts_[part].linear;
    if constexpr (kNodes == 10) return parts_[part].quadratic;
  };
  const std::vector<size_t> order = elements_by_smallest_node(*model_, kNodes);
  for (const auto& [shares_volume, dyadic] :
       {std::pair(false, true), std::pair(false, false), std::pair(true, true), std::pair(true, false)}) {
    std::vector<Batch<kNodes>*> last_batch(parts_.size(), nullptr);
    for (const size_t e : order) {
      const Tetrahedron& element = model_->elements[e];
      const size_t material = static_cast<size_t>(element.material);
      if (has_dyadic_tangent(model_->materials[material].law) != dyadic) continue;
      if ((volumes_.patch_of(static_cast<int>(e)) >= 0) != shares_volume) continue;
      Eigen::Matrix<double, 3, kNodes> positions;
      for (int a = 0; a < kNodes; ++a)
        positions.col(a) = model_->positions[static_cast<size_t>(element.nodes()[static_cast<size_t>(a)])];
      const auto shapes = [&]<int... kPoint>(std::integer_sequence<int, kPoint...>) {
        return std::array{ShapeAtPoint<kNodes>(positions, kPoint)...};
      }
      (std::make_integer_sequence<int, TetrahedronShape<kNodes>::kPoints>());
      for (const ShapeAtPoint<kNodes>& point : shapes) {
        const double gradient = point.gradients.colwise().norm().maxCoeff();
        const double force = moduli[material] * point.volume * gradient;
        rounding_at_rest_ = std::hypot(rounding_at_rest_, force);
        rounding_per_length_ = std::hypot(rounding_per_length_, force * gradient);
      }
      for (size_t part = 0; part < parts_.size(); ++part) {
        const auto is_owned = [&](int node) { return owns(static_cast<int>(part), node); };
        if (std::ranges::none_of(element.nodes(), is_owned)) continue;
        if (last_batch[part] == nullptr || last_batch[part]->num_elements == kLanes) {
          last_batch[part] = &batches_of(part).batches.emplace_back();
          last_batch[part]->dyadic = dyadic;
          last_batch[part]->shares_volume = shares_volume;
        }
        append_element(static_cast<int>(e), element, shapes, *last_batch[part]);
      }
    }
  }
  const int num_parts = static_cast<int>(parts_.size());
  for (int part = 0; part < num_parts; ++part) {
    Batches<kNodes>& kind = batches_of(static_cast<size_t>(part));
    kind.scatter.resize(kind.batches.size());
  }
  parallel_for(num_parts, num_parts, [&](int part, int) {
    auto& [batches, scatter] = batches_of(static_cast<size_t>(part));
    for (size_t i = 0; i < batches.size(); ++i) scatter[i] = scatter_of(part, batches[i]);
  });
}

template <int kNodes>
Assembly::Scatter<kNodes> Assembly::scatter_of(int part, const Batch<kNodes>& batch) const {
  Scatter<kNodes> scatter;
  for (size_t lane = 0; lane < kLanes; ++lane) {
    std::array<int, kNodes> nodes;
    for (size_t a = 0; a < kNodes; ++a) nodes[a] = batch.nodes[a][lane];
    places_of(part, nodes, scatter[lane]);
  }
  return scatter;
}

void Assembly::places_of(int part, std::span<const int> nodes, std::span<int> places) const {
  const int* starts = pattern_.outerIndexPtr();
  const int* rows = pattern_.innerIndexPtr();
  // The equations of a node are consecutive. The rows of the larger node are therefore contiguous in each
  // column of the smaller node, at a constant distance from the column's end.
  std::vector<int> from_end(nodes.size());
  size_t entry = 0;
  for (size_t b = 0; b < nodes.size(); ++b) {
    const int first_b = first_equation(nodes[b]);
    for (size_t a = b; a < nodes.size(); ++a) {
      const int first_a = first_equation(nodes[a]);
      const auto [column, row] = std::minmax(first_a, first_b);
      if (column < 0) continue;
      const int* end = rows + starts[column + 1];
      from_end[a] = static_cast<int>(end - std::lower_bound(rows + starts[column], end, row));
    }
    for (size_t axis_b = 0; axis_b < 3; ++axis_b) {
      for (size_t a = b; a < nodes.size(); ++a) {
        for (size_t axis_a = a == b ? axis_b : 0; axis_a < 3; ++axis_a, ++entry) {
          const int equation_a = dof_equations_[3 * static_cast<size_t>(nodes[a]) + axis_a];
          const int equation_b = dof_equations_[3 * static_cast<size_t>(nodes[b]) + axis_b];
          const auto [column, row] = std::minmax(equation_a, equation_b);
          // Equations ascend with nodes, so the column of the smaller node stores the coupling.
          if (column < 0 || !owns(part, std::min(nodes[a], nodes[b]))) {
            places[entry] = -1;
          } else if (a == b) {
            places[entry] = starts[column] + row - column;
          } else {
            places[entry] =
                starts[column + 1] - from_end[a] + row - std::max(first_equation(nodes[a]), first_b);
          }
        }
      }
    }
  }
}

void Assembly::place_patches() {
  parallel_for(static_cast<int>(parts_.size()), static_cast<int>(parts_.size()), [&](int number, int) {
    Part& part = parts_[static_cast<size_t>(number)];
    for (int patch = 0; patch < volumes_.num_patches(); ++patch) {
      const std::span<const int> nodes = volumes_.nodes(patch);
      if (std::ranges::none_of(nodes, [&](int node) { return owns(number, node); })) continue;
      part.patches.push_back(patch);
      const size_t entries = 3 * nodes.size() * (3 * nodes.size() + 1) / 2;
      part.patch_places.resize(part.patch_places.size() + entries);
      places_of(number, nodes, std::span(part.patch_places).last(entries));
    }
  });
}

double Assembly::rounding_force(const Eigen::VectorXd& displacement) const {
  return std::numeric_limits<double>::epsilon() *
         (rounding_at_rest_ + displacement.cwiseAbs().maxCoeff() * rounding_per_length_);
}

const CholeskyAnalysis& Assembly::analysis() const {
  std::call_once(analysis_->computed, [this] { analysis_->analysis.emplace(pattern_); });
  return *analysis_->analysis;
}

}  // namespace palpate
