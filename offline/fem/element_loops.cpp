// The element loops of Assembly: forces, energy, tangent, and their parts from shared volumes.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <type_traits>

#include "offline/fem/assembly.hpp"
#include "offline/fem/parallel_for.hpp"
#include "offline/material/constitutive_response.hpp"
#include "offline/material/volume_split.hpp"
#include "offline/numerics/decompositions.hpp"

namespace palpate {
namespace {

// Sets the negative eigenvalues of a tangent to 0. Returns whether the tangent had a negative eigenvalue.
bool clamp_negative_eigenvalues(Matrix9d& tangent) {
  const SymmetricModes modes = symmetric_modes(tangent);
  if (modes.values(0) >= 0.0) return false;
  tangent = modes.vectors * modes.values.cwiseMax(0.0).asDiagonal() * modes.vectors.transpose();
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

// Returns the shape gradients of the element in one lane: a column for each node.
template <int kNodes>
Eigen::Matrix<double, 3, kNodes> gradients_of(const typename ElementBatch<kNodes>::Point& point, int lane) {
  Eigen::Matrix<double, 3, kNodes> result;
  for (size_t a = 0; a < kNodes; ++a) {
    for (size_t J = 0; J < 3; ++J)
      result(static_cast<Eigen::Index>(J), static_cast<Eigen::Index>(a)) = point.gradients[a][J][lane];
  }
  return result;
}

template <int kNodes>
inline void add_to_lane(const Eigen::Matrix<double, 3, kNodes>& at_nodes, int lane, NodalLanes<kNodes>& sum) {
  for (int a = 0; a < kNodes; ++a) {
    for (int axis = 0; axis < 3; ++axis)
      sum[static_cast<size_t>(a)][static_cast<size_t>(axis)].add(lane, at_nodes(axis, a));
  }
}

// Includes det F of an element in `worst`. A NaN stays; between equal values the first element counts.
inline void include_jacobian(double J, int element, ElementState& worst) {
  const bool is_tie = J == worst.min_jacobian && element < worst.worst_element;
  if ((!(J >= worst.min_jacobian) && !std::isnan(worst.min_jacobian)) || is_tie) {
    worst.min_jacobian = J;
    worst.worst_element = element;
  }
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
        // The type of the last argument removes shared volumes from the code of all other elements.
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
            add_to_lane<kNodes>(at_nodes, lane, gradient);
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
        const double column_factor = scale * gradient[b];
        for (size_t a = b; a < gradient.size(); ++a, ++place) {
          if (*place >= 0) values[*place] += gradient[a] * column_factor;
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
        // At small strain J has no role, and no element counts as inverted.
        const double J = std::holds_alternative<LinearElastic>(element_law) ? 1.0 : kinematics.J[lane];
        include_jacobian(J, static_cast<int>(e), state);
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
        add_to_lane<kNodes>(at_nodes, lane, nodal);
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
  for (const ElementState& state : states) include_jacobian(state.min_jacobian, state.worst_element, worst);
  return worst;
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
