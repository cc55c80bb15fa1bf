#include "offline/fem/assembly.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "offline/fem/parallel_for.hpp"

namespace palpate {
namespace {

// Makes it the nearest positive semi-definite tangent in the Frobenius norm. False when it was that already.
bool clamp_negative_eigenvalues(Matrix9d& tangent) {
  const Eigen::SelfAdjointEigenSolver<Matrix9d> eigen(tangent);
  if (eigen.eigenvalues()(0) >= 0.0) return false;
  tangent = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
            eigen.eigenvectors().transpose();
  return true;
}

// Adds V g_a . A . g_b for a >= b, contracting one index at a time: M_iJk = V sum_L A_iJkL g_bL, K_ik = sum_J
// g_aJ M_iJk. Plain loops over contiguous numbers, which compilers put in vector registers as they do not
// with 3x3 blocks.
template <int kNodes>
void add_stiffness(const ShapeAtPoint<kNodes>& point, const Matrix9d& tangent,
                   Eigen::Matrix<double, 3 * kNodes, 3 * kNodes>& stiffness) {
  const auto& gradients = point.gradients;
  const double* A = tangent.data();
  for (int b = 0; b < kNodes; ++b) {
    const double g0 = point.volume * gradients(0, b);
    const double g1 = point.volume * gradients(1, b);
    const double g2 = point.volume * gradients(2, b);
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

// The same for a tangent in products of F and H: with f_a = F g_a and h_a = H g_a,
//   K_ab = V (identity (g_a . g_b) 1 + transposed h_b h_a^T + h_a (hh h_b + fh f_b)^T + f_a (fh h_b + ff f_b)^T).
template <int kNodes>
void add_stiffness(const ShapeAtPoint<kNodes>& point, const DyadicTangent& tangent,
                   Eigen::Matrix<double, 3 * kNodes, 3 * kNodes>& stiffness) {
  using Vectors = Eigen::Matrix<double, 3, kNodes>;
  const auto& g = point.gradients;
  const bool only_h = tangent.ff == 0.0 && tangent.fh == 0.0;
  const Vectors h = tangent.H * g;
  Vectors f = Vectors::Zero();
  if (!only_h) f = tangent.F * g;
  for (int b = 0; b < kNodes; ++b) {
    const Eigen::Vector3d identity = point.volume * tangent.identity * g.col(b);
    const Eigen::Vector3d transposed = point.volume * tangent.transposed * h.col(b);
    const Eigen::Vector3d with_h = point.volume * (tangent.hh * h.col(b) + tangent.fh * f.col(b));
    const Eigen::Vector3d with_f = point.volume * (tangent.fh * h.col(b) + tangent.ff * f.col(b));
    for (int a = b; a < kNodes; ++a) {
      auto block = stiffness.template block<3, 3>(3 * a, 3 * b);
      block += transposed * h.col(a).transpose() + h.col(a) * with_h.transpose();
      if (!only_h) block += f.col(a) * with_f.transpose();
      block.diagonal().array() += identity.dot(g.col(a));
    }
  }
}

template <int kNodes>
Eigen::Matrix3d deformation_gradient(const ShapeAtPoint<kNodes>& point,
                                     const Eigen::Matrix<double, 3, kNodes>& displacement) {
  return Eigen::Matrix3d::Identity() + displacement * point.gradients.transpose();
}

}  // namespace

const Law& Assembly::law(int element) const {
  return model_->materials[static_cast<size_t>(model_->elements[static_cast<size_t>(element)].material)].law;
}

template <int kNodes>
Eigen::Matrix<double, 3, kNodes> Assembly::nodal_values(int element, const double* values) const {
  const auto& nodes = model_->elements[static_cast<size_t>(element)].node_array;
  Eigen::Matrix<double, 3, kNodes> gathered;
  for (int a = 0; a < kNodes; ++a)
    gathered.col(a) = Eigen::Map<const Eigen::Vector3d>(values + 3 * nodes[static_cast<size_t>(a)]);
  return gathered;
}

template <typename Work>
void Assembly::for_each_part(Work&& work) const {
  parallel_for(num_parts_, num_parts_, [&](int part, int) { work(part); });
}

void Assembly::divide_nodes(int parts) {
  num_parts_ = parts;
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

  const auto share = [&]<int kNodes>(Group<kNodes>& group) {
    group.of_part.resize(static_cast<size_t>(parts));
    for (size_t i = 0; i < group.elements.size(); ++i) {
      for (const int node : model_->elements[static_cast<size_t>(group.elements[i])].nodes()) {
        std::vector<int>& mine = group.of_part[static_cast<size_t>(node_part_[static_cast<size_t>(node)])];
        if (mine.empty() || mine.back() != static_cast<int>(i)) mine.push_back(static_cast<int>(i));
      }
    }
  };
  share(linear_);
  share(quadratic_);
}

Assembly::Assembly(const Model& model, const std::vector<char>& eliminated, int threads)
    : model_(&model), threads_(std::max(1, threads)) {
  std::vector<char> has_element(static_cast<size_t>(model.num_nodes()), 0);
  for (size_t e = 0; e < model.elements.size(); ++e) {
    const Tetrahedron& element = model.elements[e];
    for (const int node : element.nodes()) has_element[static_cast<size_t>(node)] = 1;
    (element.num_nodes == 4 ? linear_.elements : quadratic_.elements).push_back(static_cast<int>(e));
  }
  constexpr size_t kWorthAThread = 2000;  // elements: a tenth of a millisecond and more
  divide_nodes(static_cast<int>(
      std::clamp<size_t>(model.elements.size() / kWorthAThread, 1, static_cast<size_t>(threads_))));
  dof_equations_.assign(static_cast<size_t>(model.num_dofs()), -1);
  for (int dof = 0; dof < model.num_dofs(); ++dof) {
    if (eliminated[static_cast<size_t>(dof)] || !has_element[static_cast<size_t>(dof / 3)]) continue;
    dof_equations_[static_cast<size_t>(dof)] = static_cast<int>(equation_dofs_.size());
    equation_dofs_.push_back(dof);
  }

  std::vector<double> moduli;
  for (const Material& material : model.materials)
    moduli.push_back(
        stress_and_tangent(material.law, Eigen::Matrix3d::Identity()).tangent.cwiseAbs().maxCoeff());
  const auto set_rest = [&]<int kNodes>(Group<kNodes>& group) {
    for (const int e : group.elements) {
      const auto positions = nodal_values<kNodes>(e, model.positions.front().data());
      const double modulus = moduli[static_cast<size_t>(model.elements[static_cast<size_t>(e)].material)];
      const auto at_points = [&]<int... kPoint>(std::integer_sequence<int, kPoint...>) {
        return typename Group<kNodes>::Points{ShapeAtPoint<kNodes>(positions, kPoint)...};
      };
      group.rest.push_back(at_points(std::make_integer_sequence<int, TetrahedronShape<kNodes>::kPoints>()));
      for (const ShapeAtPoint<kNodes>& point : group.rest.back()) {
        const double gradient = point.gradients.colwise().norm().maxCoeff();
        const double force = modulus * point.volume * gradient;
        rounding_at_rest_ = std::hypot(rounding_at_rest_, force);
        rounding_per_length_ = std::hypot(rounding_per_length_, force * gradient);
      }
    }
  };
  set_rest(linear_);
  set_rest(quadratic_);

  set_pattern();
  set_scatter(linear_);
  set_scatter(quadratic_);
}

int Assembly::first_equation(int node) const {
  for (int axis = 0; axis < 3; ++axis) {
    const int equation = dof_equations_[static_cast<size_t>(3 * node + axis)];
    if (equation >= 0) return equation;
  }
  return -1;
}

void Assembly::set_pattern() {
  std::vector<int> first_element(static_cast<size_t>(model_->num_nodes()) + 1, 0);
  for (const Tetrahedron& element : model_->elements) {
    for (const int node : element.nodes()) ++first_element[static_cast<size_t>(node) + 1];
  }
  std::partial_sum(first_element.begin(), first_element.end(), first_element.begin());
  std::vector<int> elements(static_cast<size_t>(first_element.back()));  // of node after node
  std::vector<int> next = first_element;
  for (size_t e = 0; e < model_->elements.size(); ++e) {
    for (const int node : model_->elements[e].nodes())
      elements[static_cast<size_t>(next[static_cast<size_t>(node)]++)] = static_cast<int>(e);
  }

  std::vector<int> starts = {0};
  std::vector<int> rows;
  std::vector<int>
      coupled;  // the node and those above it that share an element with it: its columns hold their rows
  std::vector<int> coupled_to(static_cast<size_t>(model_->num_nodes()), -1);
  for (int node = 0; node < model_->num_nodes(); ++node) {
    if (first_equation(node) < 0) continue;
    coupled.clear();
    for (int i = first_element[static_cast<size_t>(node)]; i < first_element[static_cast<size_t>(node) + 1];
         ++i) {
      for (const int other :
           model_->elements[static_cast<size_t>(elements[static_cast<size_t>(i)])].nodes()) {
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
void Assembly::set_scatter(Group<kNodes>& group) const {
  const int* starts = pattern_.outerIndexPtr();
  const int* rows = pattern_.innerIndexPtr();
  group.scatter.resize(group.elements.size());
  for (size_t i = 0; i < group.elements.size(); ++i) {
    const auto& nodes = model_->elements[static_cast<size_t>(group.elements[i])].node_array;
    // The equations of a node follow one another, so the rows of the larger node stand side by side in each
    // column of the smaller one, equally far from its end.
    std::array<std::array<int, kNodes>, kNodes> from_end;
    std::array<int, kNodes> first;
    for (size_t a = 0; a < kNodes; ++a) first[a] = first_equation(nodes[a]);
    for (size_t b = 0; b < kNodes; ++b) {
      for (size_t a = b; a < kNodes; ++a) {
        const auto [column, row] = std::minmax(first[a], first[b]);
        if (column < 0) continue;
        const int* end = rows + starts[column + 1];
        from_end[b][a] = static_cast<int>(end - std::lower_bound(rows + starts[column], end, row));
      }
    }
    size_t entry = 0;
    for (int b = 0; b < Group<kNodes>::kDofs; ++b) {
      for (int a = b; a < Group<kNodes>::kDofs; ++a, ++entry) {
        const size_t node_a = static_cast<size_t>(a / 3);
        const size_t node_b = static_cast<size_t>(b / 3);
        const int at_a = dof_equations_[static_cast<size_t>(3 * nodes[node_a] + a % 3)];
        const int at_b = dof_equations_[static_cast<size_t>(3 * nodes[node_b] + b % 3)];
        const auto [column, row] = std::minmax(at_a, at_b);
        int& place = group.scatter[i][entry];
        if (column < 0) {
          place = -1;
        } else if (node_a == node_b) {
          place = starts[column] + row - column;
        } else {
          place =
              starts[column + 1] - from_end[node_b][node_a] + row - std::max(first[node_a], first[node_b]);
        }
      }
    }
  }
}

ElementState Assembly::internal_force(const Eigen::VectorXd& displacement, Eigen::VectorXd& force,
                                      double* energy) const {
  force.setZero(num_dofs());
  std::vector<double> stored(energy != nullptr ? model_->elements.size() : 0, 0.0);
  std::vector<ElementState> states(static_cast<size_t>(num_parts_));
  for_each_part([&](int part) {
    ElementState& state = states[static_cast<size_t>(part)];
    state.min_jacobian = std::numeric_limits<double>::infinity();
    for_each_group([&]<int kNodes>(const Group<kNodes>& group) {
      for (const int i : group.of_part[static_cast<size_t>(part)]) {
        const int e = group.elements[static_cast<size_t>(i)];
        const Law& element_law = law(e);
        const auto u = nodal_values<kNodes>(e, displacement.data());
        const auto& nodes = model_->elements[static_cast<size_t>(e)].node_array;
        const bool counts_energy = energy != nullptr && node_part_[static_cast<size_t>(nodes[0])] == part;
        Eigen::Matrix<double, 3, kNodes> nodal = Eigen::Matrix<double, 3, kNodes>::Zero();
        for (const ShapeAtPoint<kNodes>& point : group.rest[static_cast<size_t>(i)]) {
          const Eigen::Matrix3d F = deformation_gradient<kNodes>(point, u);
          // Small strain knows no inversion.
          const double J = std::holds_alternative<LinearElastic>(element_law) ? 1.0 : F.determinant();
          if (!(J >= state.min_jacobian) && !std::isnan(state.min_jacobian)) {
            state.min_jacobian = J;
            state.worst_element = e;
          }
          if (counts_energy) {
            stored[static_cast<size_t>(e)] += J > 0 ? point.volume * strain_energy_density(element_law, F)
                                                    : std::numeric_limits<double>::infinity();
          }
          nodal += point.volume * first_piola_kirchhoff(element_law, F) * point.gradients;
        }
        for (int a = 0; a < kNodes; ++a) {
          const int node = nodes[static_cast<size_t>(a)];
          if (node_part_[static_cast<size_t>(node)] == part) force.segment<3>(3 * node) += nodal.col(a);
        }
      }
    });
  });
  if (energy != nullptr) *energy = std::accumulate(stored.begin(), stored.end(), 0.0);
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
  for_each_part([&](int part) {
    for_each_group([&]<int kNodes>(const Group<kNodes>& group) {
      constexpr int kDofs = Group<kNodes>::kDofs;
      Eigen::Matrix<double, kDofs, kDofs> element;
      for (const int i : group.of_part[static_cast<size_t>(part)]) {
        const int e = group.elements[static_cast<size_t>(i)];
        const auto u = nodal_values<kNodes>(e, displacement.data());
        element.setZero();
        for (const ShapeAtPoint<kNodes>& point : group.rest[static_cast<size_t>(i)]) {
          const Eigen::Matrix3d F = deformation_gradient<kNodes>(point, u);
          const std::optional<DyadicTangent> dyadic = dyadic_tangent(law(e), F);
          Matrix9d tangent;
          if (project || !dyadic) tangent = stress_and_tangent(law(e), F).tangent;
          const bool changed = project && clamp_negative_eigenvalues(tangent);
          if (dyadic && !changed) {
            add_stiffness<kNodes>(point, *dyadic, element);
          } else {
            add_stiffness<kNodes>(point, tangent, element);
          }
        }
        const auto& nodes = model_->elements[static_cast<size_t>(e)].node_array;
        // The column of the smaller node, as equations are numbered like nodes, holds what two nodes share.
        std::array<std::array<bool, kNodes>, kNodes> mine;
        for (size_t b = 0; b < kNodes; ++b) {
          for (size_t a = b; a < kNodes; ++a)
            mine[b][a] = node_part_[static_cast<size_t>(std::min(nodes[a], nodes[b]))] == part;
        }
        const int* place = group.scatter[static_cast<size_t>(i)].data();
        for (int b = 0; b < kDofs; ++b) {
          for (int a = b; a < kDofs; ++a, ++place) {
            if (*place >= 0 && mine[static_cast<size_t>(b / 3)][static_cast<size_t>(a / 3)])
              values[*place] += element(a, b);
          }
        }
      }
    });
  });
}

Eigen::MatrixXd Assembly::tangent_times(const Eigen::VectorXd& displacement,
                                        const Eigen::MatrixXd& vectors) const {
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(num_dofs(), vectors.cols());
  for_each_group([&]<int kNodes>(const Group<kNodes>& group) {
    for (size_t i = 0; i < group.elements.size(); ++i) {
      const int e = group.elements[i];
      const auto& nodes = model_->elements[static_cast<size_t>(e)].node_array;
      const auto moves = [&](int node) { return !vectors.middleRows<3>(3 * node).isZero(0.0); };
      if (std::none_of(nodes.begin(), nodes.begin() + kNodes, moves)) continue;
      const auto u = nodal_values<kNodes>(e, displacement.data());
      for (const ShapeAtPoint<kNodes>& point : group.rest[i]) {
        const Matrix9d tangent = stress_and_tangent(law(e), deformation_gradient<kNodes>(point, u)).tangent;
        for (Eigen::Index column = 0; column < vectors.cols(); ++column) {
          const Eigen::Matrix3d dF =
              nodal_values<kNodes>(e, vectors.col(column).data()) * point.gradients.transpose();
          const Eigen::Matrix<double, 9, 1> dP = tangent * dF.reshaped();
          const Eigen::Matrix<double, 3, kNodes> nodal = point.volume * dP.reshaped(3, 3) * point.gradients;
          for (int a = 0; a < kNodes; ++a)
            product.col(column).segment<3>(3 * nodes[static_cast<size_t>(a)]) += nodal.col(a);
        }
      }
    }
  });
  return product;
}

}  // namespace palpate
