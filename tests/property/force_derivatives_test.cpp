// Derivatives of the internal force, compared with differences of the force.
#include "offline/precompute/force_derivatives.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "tests/support/touched_block.hpp"

namespace palpate::test {
namespace force_derivatives_test {

// u(x) at free nodes: three smooth fields, and two directions for the products.
Eigen::MatrixXd smooth_fields(const Model& model) {
  Eigen::MatrixXd fields = Eigen::MatrixXd::Zero(model.num_dofs(), 5);
  const std::vector<char> fixed = model.fixed_dofs();
  for (int node = 0; node < model.num_nodes(); ++node) {
    const Eigen::Vector3d& x = model.positions[static_cast<size_t>(node)];
    for (int axis = 0; axis < 3; ++axis) {
      for (int field = 0; field < 5 && fixed[static_cast<size_t>(3 * node + axis)] == 0; ++field)
        fields(3 * node + axis, field) =
            0.1 * std::sin((1 + field) * x[axis] + (2 + axis) * x[(axis + 1) % 3] + 0.3 * field) * x.z();
    }
  }
  return fields;
}

class ForceDerivativesTest : public testing::TestWithParam<bool> {
 protected:
  static TouchedBlock block_of(bool quadratic) {
    TouchedBlock block = touched_block(quadratic ? 1 : 3, 0.3, quadratic);
    block.model.materials.front().law = CompressibleNeoHookean{1.0, 4.0};
    return block;
  }

  // P at the free dofs.
  Eigen::VectorXd force(const Eigen::VectorXd& u) const {
    Eigen::VectorXd internal;
    assembly.internal_force(at_rest + u, internal);
    for (Eigen::Index dof = 0; dof < internal.size(); ++dof) {
      if (fixed[static_cast<size_t>(dof)] != 0) internal[dof] = 0;
    }
    return internal;
  }

  TouchedBlock block = block_of(GetParam());
  Assembly assembly{block.model, block.model.fixed_dofs()};
  std::vector<char> fixed = block.model.fixed_dofs();
  Eigen::MatrixXd fields = smooth_fields(block.model);
  Eigen::VectorXd at_rest = 0.5 * fields.col(3);  // a stressed reference state, not the mesh's
  Eigen::MatrixXd along = fields.leftCols<3>();
  Eigen::MatrixXd v = fields.rightCols<2>();
};

TEST_P(ForceDerivativesTest, AreThoseOfTheForce) {
  const ForceDerivatives derivatives(assembly, at_rest, along, 3e-3, true);
  constexpr double h = 0.02;
  for (int a = 0; a < 3; ++a) {
    const Eigen::MatrixXd second = derivatives.second(a, v);
    for (int k = 0; k < 2; ++k) {
      const auto at = [&](double s, double t) -> Eigen::VectorXd {
        return force(s * along.col(a) + t * v.col(k));
      };
      const Eigen::VectorXd n2 = (at(h, h) - at(h, -h) - at(-h, h) + at(-h, -h)) / (4 * h * h);
      EXPECT_LE((second.col(k) - n2).norm(), 1e-4 * n2.norm()) << a << k;
    }
    for (int b = 0; b <= a; ++b) {
      const Eigen::MatrixXd third = derivatives.third(a, b, v);
      EXPECT_EQ(third, derivatives.third(b, a, v));
      for (int k = 0; k < 2; ++k) {
        const auto at = [&](double s, double t, double r) -> Eigen::VectorXd {
          return force(s * along.col(a) + t * along.col(b) + r * v.col(k));
        };
        Eigen::VectorXd n3 = Eigen::VectorXd::Zero(v.rows());
        for (const double s : {-h, h}) {
          for (const double t : {-h, h}) {
            for (const double r : {-h, h}) n3 += (s * t * r > 0 ? 1 : -1) * at(s, t, r) / (8 * h * h * h);
          }
        }
        EXPECT_LE((third.col(k) - n3).norm(), 1e-3 * n3.norm()) << a << b << k;
      }
    }
  }
}

TEST_P(ForceDerivativesTest, SecondOrderAloneIsTheSame) {
  const ForceDerivatives both(assembly, at_rest, along, 3e-3, true);
  const ForceDerivatives second(assembly, at_rest, along, 3e-3, false);
  for (int a = 0; a < 3; ++a) EXPECT_EQ(both.second(a, v), second.second(a, v));
}

INSTANTIATE_TEST_SUITE_P(Elements, ForceDerivativesTest, testing::Bool());

}  // namespace force_derivatives_test
}  // namespace palpate::test
