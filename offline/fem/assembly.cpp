#include "offline/fem/assembly.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <type_traits>

#include "offline/fem/parallel_for.hpp"
#include "offline/material/volume_split.hpp"

namespace palpate {
namespace {

// Projects a tangent onto the positive semi-definite matrices (Frobenius norm). Returns whether the tangent changed.
bool clamp_negative_eigenvalues(Matrix9d& tangent) {
  const Eigen::SelfAdjointEigenSolver<Matrix9d> eigen(tangent);
  if (eigen.eigenvalues()(0) >= 0.0) return false;
  tangent = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
            eigen.eigenvectors().transpose();
  return true;
}

// Adds K_ab = V g_a . A . g_b for a >= b in two contractions:
//   M_iJk = V sum_L A_iJkL g_bL,   K_ik = sum_J g_aJ M_iJk.
// Compilers vectorise these plain loops, but not 3x3 blocks.
template <int kNodes>
void add_stiffness(double volume, const Eigen::Matrix<double, 3, kNodes>& gradients, const Matrix9d& tangent,
                   Eigen::Matrix<double, 3 * kNodes, 3 * kNodes>& stiffness) {
  const double* A = tangent.data();
  for (int b = 0; b < kNodes; ++b) {
    const double g0 = volume * gradients(0, b);
    const double g1 = volume * gradients(1, b);
    const double g2 = volume * gradients(2, b);
    double contracted[27];
    for (int n = 0; n < 27; ++n) contracted[n] = g0 * A[n] + g1 * A[27 + n] + g2 * A[54 + n];
    double by_J[3][9];  // M_iJk at [J][i + 3 k]
    for (int J = 0; J < 3; ++J) {
      for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < 3; ++i) by_J[J][i + 3 * k] = contracted[i + 3 * J + 9 * k];
      }
    }
    for (int a = b; a < kNodes; ++a) {
      const double h0 = gradients(0, a);
      const double h1 = gradients(1, a);
      const double h2 = gradients(2, a);
      double block[9];
      for (int n = 0; n < 9; ++n) block[n] = h0 * by_J[0][n] + h1 * by_J[1][n] + h2 * by_J[2][n];
      for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < 3; ++i) stiffness(3 * a + i, 3 * b + k) += block[i + 3 * k];
      }
    }
  }
}

template <typename Matrix>
Eigen::Matrix3d lane_of(const Matrix& matrix, int lane) {
  Eigen::Matrix3d result;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t J = 0; J < 3; ++J)
      result(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(J)) = matrix[i][J][lane];
  }
  return result;
}

// Returns the shape gradients of an element: one column for each node.
template <int kNodes>
Eigen::Matrix<double, 3, kNodes> gradients_of(const typename ElementBatch<kNodes>::Point& point, int lane) {
  Eigen::Matrix<double, 3, kNodes> result;
  for (size_t a = 0; a < kNodes; ++a) {
    for (size_t J = 0; J < 3; ++J)
      result(static_cast<Eigen::Index>(J), static_cast<Eigen::Index>(a)) = point.gradients[a][J][lane];
  }
  return result;
}

}  // namespace

template <bool kShares, int kNodes>
const Law& Assembly::law(const Batch<kNodes>& batch, int lane) const {
  const auto material = static_cast<size_t>(batch.materials[static_cast<size_t>(lane)]);
  return kShares ? laws_without_volume_[material] : model_->materials[material].law;
}

template <int kNodes>
const Law& Assembly::law(const Batch<kNodes>& batch, int lane) const {
  return batch.shares_volume ? law<true>(batch, lane) : law<false>(batch, lane);
}

template <int kNodes>
double Assembly::pressure(const SharedVolumes::State& volumes, const Batch<kNodes>& batch, int lane) const {
  const int patch = volumes_.patch_of(batch.elements[static_cast<size_t>(lane)]);
  return volumes.pressures[static_cast<size_t>(patch)];
}

template <typename Work>
void Assembly::for_each_batch(Work&& work) const {
  const int num_parts = static_cast<int>(parts_.size());
  parallel_for(num_parts, num_parts, [&](int part, int) {
    const auto visit = [&](const auto& kind) {
      for (size_t i = 0; i < kind.batches.size(); ++i) {
        // A type avoids the cost of shared volumes for the other elements.
        if (kind.batches[i].shares_volume) {
          work(part, kind.batches[i], kind.scatter[i], std::true_type());
        } else {
          work(part, kind.batches[i], kind.scatter[i], std::false_type());
        }
      }
    };
    visit(parts_[static_cast<size_t>(part)].linear);
    visit(parts_[static_cast<size_t>(part)].quadratic);
  });
}

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
  constexpr size_t kWorthAThread = 2000;  // elements: work far above the cost of a thread's start
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
  // Coupled nodes: the nodes of an element or of a volume patch.
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
  // Lists a node and its coupled nodes of larger number: their rows stand in the node's columns.
  std::vector<int> coupled;
  std::vector<int> coupled_to(static_cast<size_t>(model_->num_nodes()), -1);
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

template <int kNodes>
void Assembly::make_batches() {
  constexpr int kPoints = TetrahedronShape<kNodes>::kPoints;
  std::vector<double> moduli;
  for (const Material& material : model_->materials)
    moduli.push_back(
        stress_and_tangent(material.law, Eigen::Matrix3d::Identity()).tangent.cwiseAbs().maxCoeff());
  const auto of_part = [&](size_t part) -> Batches<kNodes>& {
    if constexpr (kNodes == 4) return parts_[part].linear;
    if constexpr (kNodes == 10) return parts_[part].quadratic;
  };
  // Order by smallest node: neighbours in the stiffness follow one another in time.
  std::vector<size_t> order;
  for (size_t e = 0; e < model_->elements.size(); ++e) {
    if (model_->elements[e].num_nodes == kNodes) order.push_back(e);
  }
  const auto smallest = [&](size_t e) { return std::ranges::min(model_->elements[e].nodes()); };
  std::ranges::stable_sort(order, {}, smallest);
  for (const auto& [shares_volume, dyadic] :
       {std::pair(false, true), std::pair(false, false), std::pair(true, true), std::pair(true, false)}) {
    std::vector<Batch<kNodes>*> open(parts_.size(), nullptr);
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
      (std::make_integer_sequence<int, kPoints>());
      for (const ShapeAtPoint<kNodes>& point : shapes) {
        const double gradient = point.gradients.colwise().norm().maxCoeff();
        const double force = moduli[material] * point.volume * gradient;
        rounding_at_rest_ = std::hypot(rounding_at_rest_, force);
        rounding_per_length_ = std::hypot(rounding_per_length_, force * gradient);
      }
      for (size_t part = 0; part < parts_.size(); ++part) {
        const auto mine = [&](int node) { return owns(static_cast<int>(part), node); };
        if (std::ranges::none_of(element.nodes(), mine)) continue;
        if (open[part] == nullptr || open[part]->num_elements == kLanes) {
          open[part] = &of_part(part).batches.emplace_back();
          open[part]->dyadic = dyadic;
          open[part]->shares_volume = shares_volume;
        }
        Batch<kNodes>& batch = *open[part];
        for (int lane = batch.num_elements++; lane < kLanes; ++lane) {
          batch.elements[static_cast<size_t>(lane)] = static_cast<int>(e);
          batch.materials[static_cast<size_t>(lane)] = element.material;
          for (size_t a = 0; a < kNodes; ++a) {
            batch.nodes[a][static_cast<size_t>(lane)] = element.node_array[a];
            for (size_t p = 0; p < kPoints; ++p) {
              batch.points[p].volume.set(lane, shapes[p].volume);
              for (size_t axis = 0; axis < 3; ++axis)
                batch.points[p].gradients[a][axis].set(
                    lane, shapes[p].gradients(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(a)));
            }
          }
        }
      }
    }
  }
  const int num_parts = static_cast<int>(parts_.size());
  for (int part = 0; part < num_parts; ++part) {
    Batches<kNodes>& kind = of_part(static_cast<size_t>(part));
    kind.scatter.resize(kind.batches.size());
  }
  parallel_for(num_parts, num_parts, [&](int part, int) {
    auto& [batches, scatter] = of_part(static_cast<size_t>(part));
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
          const int at_a = dof_equations_[3 * static_cast<size_t>(nodes[a]) + axis_a];
          const int at_b = dof_equations_[3 * static_cast<size_t>(nodes[b]) + axis_b];
          const auto [column, row] = std::minmax(at_a, at_b);
          // Equations are numbered like nodes, so the smaller node's column stores the coupling.
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

SharedVolumes::State Assembly::volume_state(const Eigen::VectorXd& displacement, bool with_gradients) const {
  SharedVolumes::State state = volumes_.begin(with_gradients);
  if (volumes_.empty()) return state;
  for_each_batch(
      [&]<int kNodes, typename Shares>(int part, const Batch<kNodes>& batch, const Scatter<kNodes>&, Shares) {
        if (!Shares::value) return;
        const BatchKernels<kNodes>& kernels = batch_kernels<kNodes>();
        const NodalLanes<kNodes> u = gather(batch, displacement.data());
        NodalLanes<kNodes> gradient = {};
        std::array<double, kLanes> volume = {};
        for (const auto& point : batch.points) {
          KinematicsLanes kinematics;
          kernels.deform(point, u, kinematics);
          DyadicLanes terms = {};
          for (int lane = 0; lane < batch.num_elements; ++lane) {
            double& sum = volume[static_cast<size_t>(lane)];
            if (batch.dyadic) {
              sum += point.volume[lane] * kinematics.J[lane];
              terms.transposed.set(lane, -kinematics.J[lane]);
              continue;
            }
            const Eigen::Matrix3d F = lane_of(kinematics.F, lane);
            sum += point.volume[lane] * volume_measure(law(batch, lane), F);
            if (!with_gradients) continue;
            const Eigen::Matrix<double, 3, kNodes> at_nodes =
                point.volume[lane] * volume_gradient(law(batch, lane), F) * gradients_of<kNodes>(point, lane);
            for (int a = 0; a < kNodes; ++a) {
              for (int axis = 0; axis < 3; ++axis)
                gradient[static_cast<size_t>(a)][static_cast<size_t>(axis)].add(lane, at_nodes(axis, a));
            }
          }
          if (batch.dyadic && with_gradients) kernels.add_force(point, kinematics, terms, gradient);
        }
        for (int lane = 0; lane < batch.num_elements; ++lane) {
          if (!owns(part, batch.nodes[0][static_cast<size_t>(lane)])) continue;
          const auto e = static_cast<size_t>(batch.elements[static_cast<size_t>(lane)]);
          state.volumes[e] = volume[static_cast<size_t>(lane)];
          if (!with_gradients) continue;
          for (size_t a = 0; a < kNodes; ++a) {
            for (size_t axis = 0; axis < 3; ++axis)
              state.gradients[e][3 * a + axis] = gradient[a][axis][lane];
          }
        }
      });
  volumes_.finish(state);
  return state;
}

void Assembly::add_dyads(const SharedVolumes::State& volumes, double* values) const {
  parallel_for(static_cast<int>(parts_.size()), static_cast<int>(parts_.size()), [&](int number, int) {
    const Part& part = parts_[static_cast<size_t>(number)];
    const int* place = part.patch_places.data();
    std::vector<double> gradient;
    for (const int patch : part.patches) {
      volumes_.gradient(volumes, patch, gradient);
      const double scale = volumes_.dyad_scale(volumes, patch);
      for (size_t b = 0; b < gradient.size(); ++b) {
        const double of_column = scale * gradient[b];
        for (size_t a = b; a < gradient.size(); ++a, ++place) {
          if (*place >= 0) values[*place] += gradient[a] * of_column;
        }
      }
    }
  });
}

ElementState Assembly::internal_force(const Eigen::VectorXd& displacement, Eigen::VectorXd& force,
                                      double* energy) const {
  force.setZero(num_dofs());
  std::vector<double> stored(energy != nullptr ? model_->elements.size() : 0, 0.0);
  const SharedVolumes::State volumes = volume_state(displacement, false);
  std::vector<ElementState> states(parts_.size());
  for (ElementState& state : states) state.min_jacobian = std::numeric_limits<double>::infinity();
  for_each_batch([&]<int kNodes, typename Shares>(int part, const Batch<kNodes>& batch,
                                                  const Scatter<kNodes>&, Shares) {
    ElementState& state = states[static_cast<size_t>(part)];
    const BatchKernels<kNodes>& kernels = batch_kernels<kNodes>();
    const NodalLanes<kNodes> u = gather(batch, displacement.data());
    NodalLanes<kNodes> nodal = {};
    for (const auto& point : batch.points) {
      KinematicsLanes kinematics;
      kernels.deform(point, u, kinematics);
      DyadicLanes terms = {};
      for (int lane = 0; lane < batch.num_elements; ++lane) {
        const size_t e = static_cast<size_t>(batch.elements[static_cast<size_t>(lane)]);
        const Law& element_law = law<Shares::value>(batch, lane);
        // Small strain has no inversion.
        const double J = std::holds_alternative<LinearElastic>(element_law) ? 1.0 : kinematics.J[lane];
        const bool equal = J == state.min_jacobian && static_cast<int>(e) < state.worst_element;
        if ((!(J >= state.min_jacobian) && !std::isnan(state.min_jacobian)) || equal) {
          state.min_jacobian = J;
          state.worst_element = static_cast<int>(e);
        }
        const bool counts_energy = energy != nullptr && owns(part, batch.nodes[0][static_cast<size_t>(lane)]);
        if (batch.dyadic) terms.set(lane, dyadic_tangent(element_law, kinematics.I1[lane], J));
        if (batch.dyadic && !counts_energy) continue;
        const Eigen::Matrix3d F = lane_of(kinematics.F, lane);
        if (counts_energy) {
          stored[e] += J > 0 ? point.volume[lane] * strain_energy_density(element_law, F)
                             : std::numeric_limits<double>::infinity();
        }
        if (batch.dyadic) continue;
        Eigen::Matrix3d stress = first_piola_kirchhoff(element_law, F);
        if constexpr (Shares::value)
          stress += pressure(volumes, batch, lane) * volume_gradient(element_law, F);
        const Eigen::Matrix<double, 3, kNodes> at_nodes =
            point.volume[lane] * stress * gradients_of<kNodes>(point, lane);
        for (int a = 0; a < kNodes; ++a) {
          for (int axis = 0; axis < 3; ++axis)
            nodal[static_cast<size_t>(a)][static_cast<size_t>(axis)].add(lane, at_nodes(axis, a));
        }
      }
      if constexpr (Shares::value) {
        for (int lane = 0; batch.dyadic && lane < batch.num_elements; ++lane)
          terms.transposed.add(lane, -pressure(volumes, batch, lane) * kinematics.J[lane]);
      }
      if (batch.dyadic) kernels.add_force(point, kinematics, terms, nodal);
    }
    for (int lane = 0; lane < batch.num_elements; ++lane) {
      for (size_t a = 0; a < kNodes; ++a) {
        const int node = batch.nodes[a][static_cast<size_t>(lane)];
        if (!owns(part, node)) continue;
        for (int axis = 0; axis < 3; ++axis)
          force[3 * node + axis] += nodal[a][static_cast<size_t>(axis)][lane];
      }
    }
  });
  if (energy != nullptr) *energy = std::accumulate(stored.begin(), stored.end(), volumes.energy);
  ElementState worst = states.front();
  for (const ElementState& state : states) {
    if (std::isnan(worst.min_jacobian)) break;
    const bool equal = state.min_jacobian == worst.min_jacobian && state.worst_element < worst.worst_element;
    if (!(state.min_jacobian >= worst.min_jacobian) || equal) worst = state;
  }
  return worst;
}

double Assembly::rounding_force(const Eigen::VectorXd& displacement) const {
  return std::numeric_limits<double>::epsilon() *
         (rounding_at_rest_ + displacement.cwiseAbs().maxCoeff() * rounding_per_length_);
}

const CholeskyAnalysis& Assembly::analysis() const {
  std::call_once(analysis_->made, [this] { analysis_->analysis.emplace(pattern_); });
  return *analysis_->analysis;
}

void Assembly::tangent(const Eigen::VectorXd& displacement, bool project, SparseLower& stiffness) const {
  if (stiffness.rows() != pattern_.rows()) stiffness = pattern_;
  double* values = stiffness.valuePtr();
  std::fill(values, values + stiffness.nonZeros(), 0.0);
  const SharedVolumes::State volumes = volume_state(displacement, true);
  for_each_batch([&]<int kNodes, typename Shares>(int, const Batch<kNodes>& batch,
                                                  const Scatter<kNodes>& scatter, Shares) {
    constexpr int kDofs = 3 * kNodes;
    const BatchKernels<kNodes>& kernels = batch_kernels<kNodes>();
    const NodalLanes<kNodes> u = gather(batch, displacement.data());
    StiffnessLanes<kNodes> stiffness_lanes = {};
    for (const auto& point : batch.points) {
      KinematicsLanes kinematics;
      kernels.deform(point, u, kinematics);
      DyadicLanes terms = {};
      for (int lane = 0; lane < batch.num_elements; ++lane) {
        const Law& element_law = law<Shares::value>(batch, lane);
        Matrix9d tangent;
        if (project || !batch.dyadic) {
          const Eigen::Matrix3d F = lane_of(kinematics.F, lane);
          tangent = stress_and_tangent(element_law, F).tangent;
          if constexpr (Shares::value)
            add_volume_curvature(element_law, pressure(volumes, batch, lane), F, tangent);
        }
        const bool changed = project && clamp_negative_eigenvalues(tangent);
        if (batch.dyadic && !changed) {
          const double J = kinematics.J[lane];
          DyadicTangent coefficients = dyadic_tangent(element_law, kinematics.I1[lane], J);
          if constexpr (Shares::value) add_volume_terms(pressure(volumes, batch, lane), J, coefficients);
          terms.set(lane, coefficients);
          continue;
        }
        Eigen::Matrix<double, kDofs, kDofs> element = Eigen::Matrix<double, kDofs, kDofs>::Zero();
        add_stiffness<kNodes>(point.volume[lane], gradients_of<kNodes>(point, lane), tangent, element);
        size_t entry = 0;
        for (int b = 0; b < kDofs; ++b) {
          for (int a = b; a < kDofs; ++a) stiffness_lanes[entry++].add(lane, element(a, b));
        }
      }
      if (batch.dyadic) kernels.add_stiffness(point, kinematics, terms, stiffness_lanes);
    }
    for (int lane = 0; lane < batch.num_elements; ++lane) {
      const auto& places = scatter[static_cast<size_t>(lane)];
      for (size_t entry = 0; entry < places.size(); ++entry) {
        if (places[entry] >= 0) values[places[entry]] += stiffness_lanes[entry][lane];
      }
    }
  });
  add_dyads(volumes, values);
}

Eigen::MatrixXd Assembly::tangent_times(const Eigen::VectorXd& displacement,
                                        const Eigen::MatrixXd& vectors) const {
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(num_dofs(), vectors.cols());
  const SharedVolumes::State volumes = volume_state(displacement, true);
  const auto add = [&]<int kNodes>(int part, const Batch<kNodes>& batch) {
    const auto moves = [&](int node) { return !vectors.middleRows<3>(3 * node).isZero(0.0); };
    const NodalLanes<kNodes> u = gather(batch, displacement.data());
    for (const auto& point : batch.points) {
      KinematicsLanes kinematics;
      batch_kernels<kNodes>().deform(point, u, kinematics);
      for (int lane = 0; lane < batch.num_elements; ++lane) {
        const size_t e = static_cast<size_t>(batch.elements[static_cast<size_t>(lane)]);
        const auto nodes = model_->elements[e].nodes();
        if (!owns(part, nodes[0]) || std::none_of(nodes.begin(), nodes.end(), moves)) continue;
        const Eigen::Matrix3d F = lane_of(kinematics.F, lane);
        Matrix9d tangent = stress_and_tangent(law(batch, lane), F).tangent;
        if (batch.shares_volume)
          add_volume_curvature(law(batch, lane), pressure(volumes, batch, lane), F, tangent);
        const Eigen::Matrix<double, 3, kNodes> gradients = gradients_of<kNodes>(point, lane);
        for (Eigen::Index column = 0; column < vectors.cols(); ++column) {
          Eigen::Matrix<double, 3, kNodes> moved;
          for (int a = 0; a < kNodes; ++a)
            moved.col(a) = vectors.col(column).segment<3>(3 * nodes[static_cast<size_t>(a)]);
          const Eigen::Matrix3d dF = moved * gradients.transpose();
          const Eigen::Matrix<double, 9, 1> dP = tangent * dF.reshaped();
          const Eigen::Matrix<double, 3, kNodes> nodal = point.volume[lane] * dP.reshaped(3, 3) * gradients;
          for (int a = 0; a < kNodes; ++a)
            product.col(column).segment<3>(3 * nodes[static_cast<size_t>(a)]) += nodal.col(a);
        }
      }
    }
  };
  for (size_t part = 0; part < parts_.size(); ++part) {
    for (const auto& batch : parts_[part].linear.batches) add(static_cast<int>(part), batch);
    for (const auto& batch : parts_[part].quadratic.batches) add(static_cast<int>(part), batch);
  }
  std::vector<double> gradient;
  for (int patch = 0; patch < volumes_.num_patches(); ++patch) {
    const std::span<const int> nodes = volumes_.nodes(patch);
    volumes_.gradient(volumes, patch, gradient);
    const Eigen::Map<const Eigen::VectorXd> G(gradient.data(), static_cast<Eigen::Index>(gradient.size()));
    Eigen::MatrixXd moved(G.size(), vectors.cols());
    for (size_t a = 0; a < nodes.size(); ++a)
      moved.middleRows<3>(3 * static_cast<Eigen::Index>(a)) = vectors.middleRows<3>(3 * nodes[a]);
    const Eigen::MatrixXd dyad = G * (volumes_.dyad_scale(volumes, patch) * (G.transpose() * moved));
    for (size_t a = 0; a < nodes.size(); ++a)
      product.middleRows<3>(3 * nodes[a]) += dyad.middleRows<3>(3 * static_cast<Eigen::Index>(a));
  }
  return product;
}

}  // namespace palpate
