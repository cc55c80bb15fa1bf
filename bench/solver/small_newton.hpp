// Newton for laws that StaticSolver lacks, written independently: a loop over four-node tetrahedra and
// Eigen's LDL^T. The caller chooses the load steps. For a few hundred nodes.
//
// For an element with shape gradients g_a and volume V, F = 1 + sum_a u_a g_a^T and dF = B du, B of 9 x 12:
//   P_e = V B^T P(F),  K_e = V B^T dP/dF B.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <array>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "offline/material/stress_and_tangent.hpp"
#include "offline/mesh/model.hpp"
#include "offline/mesh/tetrahedron_shape.hpp"
#include "tests/support/paper_cylinder.hpp"

namespace palpate::test {

// Solves like LoadedCylinder, for any response to F. Refers to the model but ignores the model's law.
class SmallNewton {
 public:
  using Response = std::function<StressAndTangent(const Eigen::Matrix3d&)>;

  SmallNewton(const Model& model, Response response)
      : model_(model),
        response_(std::move(response)),
        fixed_(model.fixed_dofs()),
        displacement_(Eigen::VectorXd::Zero(model.num_dofs())) {}

  // Returns the displacement [num_dofs] under (0, 0, force) at P1. Starts from the last call's result.
  std::optional<Eigen::VectorXd> under(double force) {
    constexpr double kConverged = 1e-10;  // largest component of the last step, length unit
    Eigen::VectorXd load = Eigen::VectorXd::Zero(model_.num_dofs());
    load[3 * marked_node(model_, "P1") + 2] = force;
    for (int iteration = 0; iteration < 50; ++iteration) {
      if (!assemble(displacement_)) return std::nullopt;
      const Eigen::VectorXd residual = free_part(load - internal_);
      const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(stiffness_);
      const Eigen::VectorXd direction = factor.solve(residual);
      if (direction.cwiseAbs().maxCoeff() <= kConverged) return displacement_ += direction;
      // Halves the step while an element has det F <= 0 or the residual grows.
      double step = 1;
      while (step > 1e-3 && (!assemble(displacement_ + step * direction) ||
                             free_part(load - internal_).norm() > residual.norm()))
        step *= 0.5;
      displacement_ += step * direction;
    }
    return std::nullopt;
  }

 private:
  Eigen::VectorXd free_part(Eigen::VectorXd values) const {
    for (int dof = 0; dof < model_.num_dofs(); ++dof)
      if (fixed_[static_cast<size_t>(dof)]) values[dof] = 0;
    return values;
  }

  // Assembles P, and K with 1 on the diagonal of fixed dofs. Returns false where an element is inverted.
  bool assemble(const Eigen::VectorXd& displacement) {
    std::vector<Eigen::Triplet<double>> entries;
    internal_.setZero(model_.num_dofs());
    for (const Tetrahedron& element : model_.elements) {
      Eigen::Matrix<double, 3, 4> rest;
      Eigen::Matrix<double, 3, 4> moved;
      std::array<int, 12> dofs{};
      for (int a = 0; a < 4; ++a) {
        const int node = element.node_array[static_cast<size_t>(a)];
        rest.col(a) = model_.positions[static_cast<size_t>(node)];
        moved.col(a) = displacement.segment<3>(3 * node);
        for (int axis = 0; axis < 3; ++axis) dofs[static_cast<size_t>(3 * a + axis)] = 3 * node + axis;
      }
      const ShapeAtPoint<4> shape(rest, 0);
      const Eigen::Matrix3d F = Eigen::Matrix3d::Identity() + moved * shape.gradients.transpose();
      if (F.determinant() <= 0) return false;
      Eigen::Matrix<double, 9, 12> B;  // dF_iJ = sum_a u_ai g_aJ
      B.setZero();
      for (int a = 0; a < 4; ++a)
        for (int J = 0; J < 3; ++J)
          for (int i = 0; i < 3; ++i) B(i + 3 * J, 3 * a + i) = shape.gradients(J, a);
      const StressAndTangent response = response_(F);
      const Eigen::Matrix<double, 12, 1> force =
          shape.volume * B.transpose() * response.first_piola_kirchhoff.reshaped();
      const Eigen::Matrix<double, 12, 12> stiffness = shape.volume * B.transpose() * response.tangent * B;
      for (int a = 0; a < 12; ++a) {
        const int row = dofs[static_cast<size_t>(a)];
        internal_[row] += force[a];
        for (int b = 0; b < 12; ++b) {
          const int column = dofs[static_cast<size_t>(b)];
          if (!fixed_[static_cast<size_t>(row)] && !fixed_[static_cast<size_t>(column)])
            entries.emplace_back(row, column, stiffness(a, b));
        }
      }
    }
    for (int dof = 0; dof < model_.num_dofs(); ++dof)
      if (fixed_[static_cast<size_t>(dof)]) entries.emplace_back(dof, dof, 1.0);
    stiffness_.resize(model_.num_dofs(), model_.num_dofs());
    stiffness_.setFromTriplets(entries.begin(), entries.end());
    return true;
  }

  const Model& model_;
  Response response_;
  std::vector<char> fixed_;
  Eigen::VectorXd displacement_;
  Eigen::VectorXd internal_;
  Eigen::SparseMatrix<double> stiffness_;
};

}  // namespace palpate::test
