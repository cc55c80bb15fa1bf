#include "offline/fem/assembly.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

// The nearest positive semi-definite tangent in the Frobenius norm.
void clamp_negative_eigenvalues(Matrix9d& tangent) {
  const Eigen::SelfAdjointEigenSolver<Matrix9d> eigen(tangent);
  if (eigen.eigenvalues()(0) >= 0.0) return;
  tangent = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
            eigen.eigenvectors().transpose();
}

// Adds V g_a . A . g_b for a >= b, contracting one index at a time: T_aL = sum_J g_aJ A_JL, K_ab = sum_L T_aL
// g_bL.
template <int kNodes>
void add_stiffness(const ShapeAtPoint<kNodes>& point, const Matrix9d& tangent,
                   Eigen::Matrix<double, 3 * kNodes, 3 * kNodes>& stiffness) {
  const auto& gradients = point.gradients;
  for (int a = 0; a < kNodes; ++a) {
    std::array<Eigen::Matrix3d, 3> contracted;
    for (int L = 0; L < 3; ++L) {
      contracted[static_cast<size_t>(L)] = point.volume * (gradients(0, a) * tangent.block<3, 3>(0, 3 * L) +
                                                           gradients(1, a) * tangent.block<3, 3>(3, 3 * L) +
                                                           gradients(2, a) * tangent.block<3, 3>(6, 3 * L));
    }
    for (int b = 0; b <= a; ++b) {
      stiffness.template block<3, 3>(3 * a, 3 * b) +=
          contracted[0] * gradients(0, b) + contracted[1] * gradients(1, b) + contracted[2] * gradients(2, b);
    }
  }
}

template <int kNodes>
Eigen::Matrix3d deformation_gradient(const ShapeAtPoint<kNodes>& point,
                                     const Eigen::Matrix<double, 3, kNodes>& displacement) {
  return Eigen::Matrix3d::Identity() + displacement * point.gradients.transpose();
}

}  // namespace

int Assembly::equation_of(const Tetrahedron& element, int local) const {
  const int node = element.node_array[static_cast<size_t>(local / 3)];
  return dof_equations_[static_cast<size_t>(3 * node + local % 3)];
}

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

Assembly::Assembly(const Model& model, const std::vector<char>& eliminated) : model_(&model) {
  std::vector<char> has_element(static_cast<size_t>(model.num_nodes()), 0);
  for (size_t e = 0; e < model.elements.size(); ++e) {
    const Tetrahedron& element = model.elements[e];
    for (const int node : element.nodes()) has_element[static_cast<size_t>(node)] = 1;
    (element.num_nodes == 4 ? linear_.elements : quadratic_.elements).push_back(static_cast<int>(e));
  }
  dof_equations_.assign(static_cast<size_t>(model.num_dofs()), -1);
  for (int dof = 0; dof < model.num_dofs(); ++dof) {
    if (eliminated[static_cast<size_t>(dof)] || !has_element[static_cast<size_t>(dof / 3)]) continue;
    dof_equations_[static_cast<size_t>(dof)] = static_cast<int>(equation_dofs_.size());
    equation_dofs_.push_back(dof);
  }

  const auto set_rest = [&]<int kNodes>(Group<kNodes>& group) {
    for (const int e : group.elements) {
      const auto positions = nodal_values<kNodes>(e, model.positions.front().data());
      const double modulus =
          stress_and_tangent(law(e), Eigen::Matrix3d::Identity()).tangent.cwiseAbs().maxCoeff();
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

  std::vector<std::vector<int>> rows(equation_dofs_.size());
  for (const Tetrahedron& element : model.elements) {
    const int dofs = 3 * element.num_nodes;
    for (int b = 0; b < dofs; ++b) {
      const int column = equation_of(element, b);
      if (column < 0) continue;
      for (int a = 0; a < dofs; ++a) {
        const int row = equation_of(element, a);
        if (row >= column) rows[static_cast<size_t>(column)].push_back(row);
      }
    }
  }
  std::vector<int> counts(rows.size());
  for (size_t column = 0; column < rows.size(); ++column) {
    std::sort(rows[column].begin(), rows[column].end());
    rows[column].erase(std::unique(rows[column].begin(), rows[column].end()), rows[column].end());
    counts[column] = static_cast<int>(rows[column].size());
  }
  const int n = num_equations();
  pattern_.resize(n, n);
  pattern_.reserve(counts);
  for (int column = 0; column < n; ++column) {
    for (const int row : rows[static_cast<size_t>(column)]) pattern_.insert(row, column) = 0.0;
  }
  pattern_.makeCompressed();

  const auto place_of = [&](int first, int second) {
    if (first < 0 || second < 0) return -1;
    const int* begin = pattern_.innerIndexPtr() + pattern_.outerIndexPtr()[std::min(first, second)];
    const int* end = pattern_.innerIndexPtr() + pattern_.outerIndexPtr()[std::min(first, second) + 1];
    return static_cast<int>(std::lower_bound(begin, end, std::max(first, second)) - pattern_.innerIndexPtr());
  };
  const auto set_scatter = [&]<int kNodes>(Group<kNodes>& group) {
    group.scatter.resize(group.elements.size());
    for (size_t i = 0; i < group.elements.size(); ++i) {
      const Tetrahedron& element = model.elements[static_cast<size_t>(group.elements[i])];
      size_t entry = 0;
      for (int b = 0; b < Group<kNodes>::kDofs; ++b) {
        for (int a = b; a < Group<kNodes>::kDofs; ++a, ++entry)
          group.scatter[i][entry] = place_of(equation_of(element, a), equation_of(element, b));
      }
    }
  };
  set_scatter(linear_);
  set_scatter(quadratic_);
}

ElementState Assembly::internal_force(const Eigen::VectorXd& displacement, Eigen::VectorXd& force,
                                      double* energy) const {
  force.setZero(num_dofs());
  ElementState state;
  state.min_jacobian = std::numeric_limits<double>::infinity();
  double stored = 0;
  for_each_group([&]<int kNodes>(const Group<kNodes>& group) {
    for (size_t i = 0; i < group.elements.size(); ++i) {
      const int e = group.elements[i];
      const Law& element_law = law(e);
      const auto u = nodal_values<kNodes>(e, displacement.data());
      Eigen::Matrix<double, 3, kNodes> nodal = Eigen::Matrix<double, 3, kNodes>::Zero();
      for (const ShapeAtPoint<kNodes>& point : group.rest[i]) {
        const Eigen::Matrix3d F = deformation_gradient<kNodes>(point, u);
        // Small strain knows no inversion.
        const double J = std::holds_alternative<LinearElastic>(element_law) ? 1.0 : F.determinant();
        if (!(J >= state.min_jacobian)) {
          state.min_jacobian = J;
          state.worst_element = e;
        }
        if (energy != nullptr) {
          stored += J > 0 ? point.volume * strain_energy_density(element_law, F)
                          : std::numeric_limits<double>::infinity();
        }
        nodal += point.volume * first_piola_kirchhoff(element_law, F) * point.gradients;
      }
      const auto& nodes = model_->elements[static_cast<size_t>(e)].node_array;
      for (int a = 0; a < kNodes; ++a) force.segment<3>(3 * nodes[static_cast<size_t>(a)]) += nodal.col(a);
    }
  });
  if (energy != nullptr) *energy = stored;
  return state;
}

double Assembly::rounding_force(const Eigen::VectorXd& displacement) const {
  return std::numeric_limits<double>::epsilon() *
         (rounding_at_rest_ + displacement.cwiseAbs().maxCoeff() * rounding_per_length_);
}

void Assembly::tangent(const Eigen::VectorXd& displacement, bool project, SparseLower& stiffness) const {
  if (stiffness.rows() != pattern_.rows()) stiffness = pattern_;
  double* values = stiffness.valuePtr();
  std::fill(values, values + stiffness.nonZeros(), 0.0);
  for_each_group([&]<int kNodes>(const Group<kNodes>& group) {
    constexpr int kDofs = Group<kNodes>::kDofs;
    Eigen::Matrix<double, kDofs, kDofs> element;
    for (size_t i = 0; i < group.elements.size(); ++i) {
      const int e = group.elements[i];
      const auto u = nodal_values<kNodes>(e, displacement.data());
      element.setZero();
      for (const ShapeAtPoint<kNodes>& point : group.rest[i]) {
        StressAndTangent response = stress_and_tangent(law(e), deformation_gradient<kNodes>(point, u));
        if (project) clamp_negative_eigenvalues(response.tangent);
        add_stiffness<kNodes>(point, response.tangent, element);
      }
      size_t entry = 0;
      for (int b = 0; b < kDofs; ++b) {
        for (int a = b; a < kDofs; ++a, ++entry) {
          const int place = group.scatter[i][entry];
          // Within a 3x3 diagonal block both halves are filled; below it only the lower one.
          if (place >= 0) values[place] += element(a, b);
        }
      }
    }
  });
}

Eigen::MatrixXd Assembly::tangent_times(const Eigen::VectorXd& displacement,
                                        const Eigen::MatrixXd& vectors) const {
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(num_dofs(), vectors.cols());
  for_each_group([&]<int kNodes>(const Group<kNodes>& group) {
    for (size_t i = 0; i < group.elements.size(); ++i) {
      const int e = group.elements[i];
      const auto& nodes = model_->elements[static_cast<size_t>(e)].node_array;
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
