#include "offline/fem/assembly.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

constexpr int kNodes = 4;
constexpr int kDofs = 12;
using ElementStiffness = Eigen::Matrix<double, kDofs, kDofs>;

// The nearest positive semi-definite tangent in the Frobenius norm.
void clamp_negative_eigenvalues(Matrix9d& tangent) {
  const Eigen::SelfAdjointEigenSolver<Matrix9d> eigen(tangent);
  if (eigen.eigenvalues()(0) >= 0.0) return;
  tangent = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
            eigen.eigenvectors().transpose();
}

// K_ab = V g_a . A . g_b, contracting one index at a time: T_aL = sum_J g_aJ A_JL, K_ab = sum_L T_aL g_bL.
void element_stiffness(const Eigen::Matrix<double, 3, 4>& gradients, double volume, const Matrix9d& tangent,
                       ElementStiffness& stiffness) {
  for (int a = 0; a < kNodes; ++a) {
    std::array<Eigen::Matrix3d, 3> contracted;
    for (int L = 0; L < 3; ++L) {
      contracted[static_cast<size_t>(L)] = volume * (gradients(0, a) * tangent.block<3, 3>(0, 3 * L) +
                                                     gradients(1, a) * tangent.block<3, 3>(3, 3 * L) +
                                                     gradients(2, a) * tangent.block<3, 3>(6, 3 * L));
    }
    for (int b = 0; b <= a; ++b) {
      stiffness.block<3, 3>(3 * a, 3 * b) =
          contracted[0] * gradients(0, b) + contracted[1] * gradients(1, b) + contracted[2] * gradients(2, b);
    }
  }
}

}  // namespace

Assembly::Assembly(const Model& model, const std::vector<char>& eliminated) : model_(&model) {
  // det of the edge matrix is 6 V; the rows of its inverse are the gradients of N_1..N_3, and N_0 = 1 - N_1 -
  // N_2 - N_3.
  rest_.reserve(model.elements.size());
  std::vector<char> has_element(static_cast<size_t>(model.num_nodes()), 0);
  for (const Tetrahedron& element : model.elements) {
    std::array<Eigen::Vector3d, kNodes> x;
    for (size_t a = 0; a < kNodes; ++a) {
      x[a] = model.positions[static_cast<size_t>(element.nodes[a])];
      has_element[static_cast<size_t>(element.nodes[a])] = 1;
    }
    Eigen::Matrix3d edges;
    edges << x[1] - x[0], x[2] - x[0], x[3] - x[0];
    Rest rest;
    rest.volume = edges.determinant() / 6.0;
    rest.gradients.rightCols<3>() = edges.inverse().transpose();
    rest.gradients.col(0) = -rest.gradients.rightCols<3>().rowwise().sum();
    rest_.push_back(rest);
  }
  for (size_t e = 0; e < rest_.size(); ++e) {
    const double modulus = stress_and_tangent(law(static_cast<int>(e)), Eigen::Matrix3d::Identity())
                               .tangent.cwiseAbs()
                               .maxCoeff();
    const double gradient = rest_[e].gradients.colwise().norm().maxCoeff();
    const double force = modulus * rest_[e].volume * gradient;
    rounding_at_rest_ = std::hypot(rounding_at_rest_, force);
    rounding_per_length_ = std::hypot(rounding_per_length_, force * gradient);
  }

  dof_equations_.assign(static_cast<size_t>(model.num_dofs()), -1);
  for (int dof = 0; dof < model.num_dofs(); ++dof) {
    if (eliminated[static_cast<size_t>(dof)] || !has_element[static_cast<size_t>(dof / 3)]) continue;
    dof_equations_[static_cast<size_t>(dof)] = static_cast<int>(equation_dofs_.size());
    equation_dofs_.push_back(dof);
  }

  std::vector<std::vector<int>> rows(equation_dofs_.size());
  const auto equation_of = [&](const Tetrahedron& element, int local) {
    return dof_equations_[static_cast<size_t>(3 * element.nodes[static_cast<size_t>(local / 3)] + local % 3)];
  };
  for (const Tetrahedron& element : model.elements) {
    for (int a = 0; a < kDofs; ++a) {
      for (int b = 0; b < kDofs; ++b) {
        const int row = equation_of(element, a);
        const int column = equation_of(element, b);
        if (column >= 0 && row >= column) rows[static_cast<size_t>(column)].push_back(row);
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

  scatter_.resize(model.elements.size());
  for (size_t e = 0; e < model.elements.size(); ++e) {
    size_t entry = 0;
    for (int b = 0; b < kDofs; ++b) {
      for (int a = b; a < kDofs; ++a, ++entry) {
        const int first = equation_of(model.elements[e], a);
        const int second = equation_of(model.elements[e], b);
        scatter_[e][entry] = -1;
        if (first < 0 || second < 0) continue;
        const int* begin = pattern_.innerIndexPtr() + pattern_.outerIndexPtr()[std::min(first, second)];
        const int* end = pattern_.innerIndexPtr() + pattern_.outerIndexPtr()[std::min(first, second) + 1];
        scatter_[e][entry] = static_cast<int>(std::lower_bound(begin, end, std::max(first, second)) -
                                              pattern_.innerIndexPtr());
      }
    }
  }
}

Eigen::Matrix3d Assembly::deformation_gradient(int element, const Eigen::VectorXd& displacement) const {
  const auto& nodes = model_->elements[static_cast<size_t>(element)].nodes;
  const Gradients& gradients = rest_[static_cast<size_t>(element)].gradients;
  Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
  for (int a = 0; a < kNodes; ++a) {
    F += displacement.segment<3>(3 * nodes[static_cast<size_t>(a)]) * gradients.col(a).transpose();
  }
  return F;
}

const Law& Assembly::law(int element) const {
  return model_->materials[static_cast<size_t>(model_->elements[static_cast<size_t>(element)].material)].law;
}

ElementState Assembly::internal_force(const Eigen::VectorXd& displacement, Eigen::VectorXd& force,
                                      double* energy) const {
  force.setZero(num_dofs());
  ElementState state;
  state.min_jacobian = std::numeric_limits<double>::infinity();
  double stored = 0;
  const int num_elements = static_cast<int>(rest_.size());
  for (int e = 0; e < num_elements; ++e) {
    const Rest& rest = rest_[static_cast<size_t>(e)];
    const Eigen::Matrix3d F = deformation_gradient(e, displacement);
    // Small strain knows no inversion.
    const double J = std::holds_alternative<LinearElastic>(law(e)) ? 1.0 : F.determinant();
    if (!(J >= state.min_jacobian)) {
      state.min_jacobian = J;
      state.worst_element = e;
    }
    if (energy != nullptr) {
      stored +=
          J > 0 ? rest.volume * strain_energy_density(law(e), F) : std::numeric_limits<double>::infinity();
    }
    const Eigen::Matrix<double, 3, 4> nodal = rest.volume * first_piola_kirchhoff(law(e), F) * rest.gradients;
    for (int a = 0; a < kNodes; ++a) {
      force.segment<3>(3 * model_->elements[static_cast<size_t>(e)].nodes[static_cast<size_t>(a)]) +=
          nodal.col(a);
    }
  }
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
  ElementStiffness element;
  const int num_elements = static_cast<int>(rest_.size());
  for (int e = 0; e < num_elements; ++e) {
    const Rest& rest = rest_[static_cast<size_t>(e)];
    StressAndTangent response = stress_and_tangent(law(e), deformation_gradient(e, displacement));
    if (project) clamp_negative_eigenvalues(response.tangent);
    element_stiffness(rest.gradients, rest.volume, response.tangent, element);
    const std::array<int, kEntries>& scatter = scatter_[static_cast<size_t>(e)];
    size_t entry = 0;
    for (int b = 0; b < kDofs; ++b) {
      for (int a = b; a < kDofs; ++a, ++entry) {
        if (scatter[entry] < 0) continue;
        // Within a 3x3 diagonal block both halves are filled; below it only the lower one.
        values[scatter[entry]] += element(a, b);
      }
    }
  }
}

Eigen::MatrixXd Assembly::tangent_times(const Eigen::VectorXd& displacement,
                                        const Eigen::MatrixXd& vectors) const {
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(num_dofs(), vectors.cols());
  const int num_elements = static_cast<int>(rest_.size());
  for (int e = 0; e < num_elements; ++e) {
    const Rest& rest = rest_[static_cast<size_t>(e)];
    const auto& nodes = model_->elements[static_cast<size_t>(e)].nodes;
    const Matrix9d tangent = stress_and_tangent(law(e), deformation_gradient(e, displacement)).tangent;
    for (Eigen::Index column = 0; column < vectors.cols(); ++column) {
      Eigen::Matrix3d dF = Eigen::Matrix3d::Zero();
      for (int a = 0; a < kNodes; ++a) {
        dF += vectors.col(column).segment<3>(3 * nodes[static_cast<size_t>(a)]) *
              rest.gradients.col(a).transpose();
      }
      const Eigen::Matrix<double, 9, 1> dP = tangent * dF.reshaped();
      const Eigen::Matrix<double, 3, 4> nodal = rest.volume * dP.reshaped(3, 3) * rest.gradients;
      for (int a = 0; a < kNodes; ++a) {
        product.col(column).segment<3>(3 * nodes[static_cast<size_t>(a)]) += nodal.col(a);
      }
    }
  }
  return product;
}

}  // namespace palpate
