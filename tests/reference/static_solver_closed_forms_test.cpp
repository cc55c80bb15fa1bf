// The solver on blocks of irregular tetrahedra, compared with closed forms of Zhong et al. 2005 eq. (1).
// Linear tetrahedra represent homogeneous deformations, so the error is the solver's tolerance and rounding.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "offline/fem/static_solver.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace static_solver_closed_forms_test {

using test::affine_displacement;
using test::BlockShape;
using test::no_dofs;
using test::nodes_on_plane;
using test::TestRandom;
using test::tetrahedral_block;

// Over the block's size for displacements, over the reaction for forces.
constexpr double kClosedForm = 1e-10;
// A tighter residual than the default 1e-10, which may leave 1.3e-10 in a small reaction (stretch 1.1, lambda
// = 50 mu).
constexpr double kResidual = 1e-12;

const Eigen::Vector3d kSize(1.0, 1.3, 0.7);

Model block(const CompressibleNeoHookean& law) {
  BlockShape shape;
  shape.size = kSize;
  shape.law = law;
  return tetrahedral_block(shape);
}

// The root between `low` and `high` of a function that changes sign once, from negative to positive.
double bisect(const std::function<double(double)>& f, double low, double high) {
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (f(middle) < 0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

void hold(LoadCase& load, const std::vector<int>& nodes, int axis, double value) {
  for (const int node : nodes) {
    load.held[static_cast<size_t>(3 * node + axis)] = 1;
    load.displacement[3 * node + axis] = value;
  }
}

double sum(const Eigen::VectorXd& force, const std::vector<int>& nodes, int axis) {
  double total = 0;
  for (const int node : nodes) total += force[3 * node + axis];
  return total;
}

SolverSettings exact() {
  SolverSettings settings;
  settings.residual_tolerance = kResidual;
  return settings;
}

struct Solution {
  SolveReport report;
  Eigen::VectorXd displacement;
  Eigen::VectorXd force;
};

Solution solve_from_rest(const Model& model, const LoadCase& load) {
  const Assembly assembly(model, no_dofs(model));
  StaticSolver solver(assembly);
  LoadCase start = load;
  start.displacement.setZero();
  start.force.setZero();
  Solution solution;
  solution.displacement.setZero(model.num_dofs());
  solution.report = solver.ramp(start, load, solution.displacement, exact());
  assembly.internal_force(solution.displacement, solution.force);
  return solution;
}

// Rollers on the planes x = 0, y = 0, z = 0.
LoadCase on_rollers(const Model& model) {
  LoadCase load = LoadCase::rest(model);
  for (int axis = 0; axis < 3; ++axis) hold(load, nodes_on_plane(model, axis, 0.0), axis, 0.0);
  return load;
}

const std::vector<CompressibleNeoHookean> kLaws = {{0.48, 0.2}, {1.0, 4.0}, {1.0, 50.0}};

TEST(StaticSolverClosedForm, UniaxialTensionAndCompression) {
  for (const CompressibleNeoHookean& law : kLaws) {
    const Model model = block(law);
    const std::vector<int> top = nodes_on_plane(model, 2, kSize.z());
    for (const double s : {0.6, 0.8, 0.95, 1.1, 1.3, 1.6}) {
      LoadCase load = on_rollers(model);
      hold(load, top, 2, (s - 1) * kSize.z());
      const Solution solution = solve_from_rest(model, load);
      ASSERT_TRUE(solution.report.converged) << s;

      // F = diag(a, a, s), J = q s with q = a^2; no traction on the sides: a P_11 = mu (q - 1) + lambda J (J
      // - 1) = 0.
      const double q = bisect([&](double x) { return law.mu * (x - 1) + law.lambda * x * s * (x * s - 1); },
                              0.0, std::max(1.0, 1 / s));
      const double a = std::sqrt(q);
      const double J = q * s;
      const double stress = law.mu * (s - 1 / s) + law.lambda * J * (J - 1) / s;
      const Eigen::VectorXd expected = affine_displacement(model, Eigen::Vector3d(a, a, s).asDiagonal());
      EXPECT_LE((solution.displacement - expected).cwiseAbs().maxCoeff(), kClosedForm * kSize.maxCoeff())
          << "stretch " << s << ", lambda " << law.lambda;
      const double reaction = stress * kSize.x() * kSize.y();
      EXPECT_NEAR(sum(solution.force, top, 2), reaction, kClosedForm * std::abs(reaction))
          << "stretch " << s << ", lambda " << law.lambda;
      EXPECT_NEAR(sum(solution.force, nodes_on_plane(model, 2, 0.0), 2), -reaction,
                  kClosedForm * std::abs(reaction));
      EXPECT_NEAR(solution.report.min_jacobian, J, kClosedForm);
    }
  }
}

TEST(StaticSolverClosedForm, UniaxialByForces) {
  const CompressibleNeoHookean law = {1.0, 4.0};
  const Model model = block(law);
  const double s = 1.4;
  const double q =
      bisect([&](double x) { return law.mu * (x - 1) + law.lambda * x * s * (x * s - 1); }, 0.0, 1.0);
  const double J = q * s;
  const double stress = law.mu * (s - 1 / s) + law.lambda * J * (J - 1) / s;
  // Consistent nodal forces of a uniform traction: a third of a top triangle's force to each corner.
  LoadCase load = on_rollers(model);
  for (const Tetrahedron& element : model.elements) {
    std::vector<int> corners;
    std::vector<Eigen::Vector3d> at;
    for (const int node : element.nodes()) {
      if (model.positions[static_cast<size_t>(node)].z() < kSize.z() - 1e-9) continue;
      corners.push_back(node);
      at.push_back(model.positions[static_cast<size_t>(node)]);
    }
    if (corners.size() != 3) continue;
    const double area =
        0.5 * std::abs((at[1] - at[0]).x() * (at[2] - at[0]).y() - (at[1] - at[0]).y() * (at[2] - at[0]).x());
    for (const int node : corners) load.force[3 * node + 2] += stress * area / 3;
  }
  const Solution solution = solve_from_rest(model, load);
  ASSERT_TRUE(solution.report.converged);
  const Eigen::VectorXd expected =
      affine_displacement(model, Eigen::Vector3d(std::sqrt(q), std::sqrt(q), s).asDiagonal());
  EXPECT_LE((solution.displacement - expected).cwiseAbs().maxCoeff(), kClosedForm * kSize.maxCoeff());
}

TEST(StaticSolverClosedForm, EquibiaxialStretch) {
  for (const CompressibleNeoHookean& law : kLaws) {
    const Model model = block(law);
    for (const double s : {0.6, 0.8, 1.2, 1.6}) {
      LoadCase load = on_rollers(model);
      hold(load, nodes_on_plane(model, 0, kSize.x()), 0, (s - 1) * kSize.x());
      hold(load, nodes_on_plane(model, 1, kSize.y()), 1, (s - 1) * kSize.y());
      const Solution solution = solve_from_rest(model, load);
      ASSERT_TRUE(solution.report.converged) << s;

      // F = diag(s, s, c), J = s^2 c; free top: c P_33 = mu (c^2 - 1) + lambda J (J - 1) = 0.
      const double c =
          bisect([&](double x) { return law.mu * (x * x - 1) + law.lambda * s * s * x * (s * s * x - 1); },
                 0.0, std::max(1.0, 1 / (s * s)));
      const double J = s * s * c;
      const double stress = law.mu * (s - 1 / s) + law.lambda * J * (J - 1) / s;
      const Eigen::VectorXd expected = affine_displacement(model, Eigen::Vector3d(s, s, c).asDiagonal());
      EXPECT_LE((solution.displacement - expected).cwiseAbs().maxCoeff(), kClosedForm * kSize.maxCoeff())
          << "stretch " << s << ", lambda " << law.lambda;
      for (const int axis : {0, 1}) {
        const double reaction = stress * kSize.z() * kSize[1 - axis];
        EXPECT_NEAR(sum(solution.force, nodes_on_plane(model, axis, kSize[axis]), axis), reaction,
                    kClosedForm * std::abs(reaction))
            << "stretch " << s << ", lambda " << law.lambda;
      }
    }
  }
}

// Every boundary node follows F, and the solver finds the interior. A homogeneous state has sum_a f_a X_a^T =
// V P.
void expect_patch(const Model& model, const Eigen::Matrix3d& F, const Eigen::Matrix3d& stress) {
  LoadCase load = LoadCase::rest(model);
  const Eigen::VectorXd expected = affine_displacement(model, F);
  int free_nodes = 0;
  for (int node = 0; node < model.num_nodes(); ++node) {
    const Eigen::Vector3d& at = model.positions[static_cast<size_t>(node)];
    if ((at.array() > 1e-9).all() && (at.array() < kSize.array() - 1e-9).all()) {
      ++free_nodes;
      continue;
    }
    for (int axis = 0; axis < 3; ++axis) {
      load.held[static_cast<size_t>(3 * node + axis)] = 1;
      load.displacement[3 * node + axis] = expected[3 * node + axis];
    }
  }
  ASSERT_EQ(free_nodes, 8);
  const Assembly assembly(model, no_dofs(model));
  StaticSolver solver(assembly);

  const auto check = [&](const Eigen::VectorXd& displacement, const char* how) {
    EXPECT_LE((displacement - expected).cwiseAbs().maxCoeff(), kClosedForm * kSize.maxCoeff()) << how;
    Eigen::VectorXd force;
    assembly.internal_force(displacement, force);
    Eigen::Matrix3d dyad = Eigen::Matrix3d::Zero();
    for (int node = 0; node < model.num_nodes(); ++node)
      dyad += force.segment<3>(3 * node) * model.positions[static_cast<size_t>(node)].transpose();
    EXPECT_LE((dyad - kSize.prod() * stress).norm(), kClosedForm * kSize.prod() * stress.norm()) << how;
  };
  Eigen::VectorXd displacement = Eigen::VectorXd::Zero(model.num_dofs());
  ASSERT_TRUE(solver.ramp(LoadCase::rest(model), load, displacement, exact()).converged);
  check(displacement, "along the ramp");

  // From a randomly disturbed interior.
  TestRandom random(71);
  for (int dof = 0; dof < model.num_dofs(); ++dof) {
    if (!load.held[static_cast<size_t>(dof)]) displacement[dof] += 0.02 * random();
  }
  const SolveReport report = solver.correct(load, displacement, exact());
  ASSERT_TRUE(report.converged);
  EXPECT_GT(report.iterations, 1);
  check(displacement, "after a shake");
}

TEST(StaticSolverClosedForm, SimpleShearOfAPatch) {
  for (const CompressibleNeoHookean& law : kLaws) {
    const Model model = block(law);
    for (const double shear : {0.1, 0.5, 1.0}) {
      SCOPED_TRACE(shear);
      Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
      F(0, 1) = shear;
      // J = 1 and F^-T = 1 - shear e2 e1^T: P = mu shear (e1 e2^T + e2 e1^T).
      Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();
      stress(0, 1) = stress(1, 0) = law.mu * shear;
      expect_patch(model, F, stress);
    }
  }
}

TEST(StaticSolverClosedForm, DilatationOfAPatch) {
  for (const CompressibleNeoHookean& law : kLaws) {
    const Model model = block(law);
    for (const double s : {0.7, 1.4}) {
      SCOPED_TRACE(s);
      const double J = s * s * s;
      const double pressure = law.mu * (s - 1 / s) + law.lambda * J * (J - 1) / s;
      expect_patch(model, s * Eigen::Matrix3d::Identity(), pressure * Eigen::Matrix3d::Identity());
    }
  }
}

TEST(StaticSolverClosedForm, TurnedSimpleShearOfAPatch) {
  const CompressibleNeoHookean law = {1.0, 4.0};
  const Model model = block(law);
  const Eigen::Matrix3d Q = test::rotation_about({1, 2, -1}, 0.4);
  Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
  F(0, 1) = 0.6;
  Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();
  stress(0, 1) = stress(1, 0) = law.mu * 0.6;
  expect_patch(model, Q * F, Q * stress);
}

// An element on a fixed face, with its apex pressed straight at the face: F = diag(1, 1, s). P_33 = mu (s -
// 1/s) + lambda (s - 1) is finite for s < 0 too. (mu + lambda) s^2 - (lambda + p) s - mu = 0 has a root on
// either side of zero. Newton's first step from rest overshoots to s < 0, where the residual is smaller.
TEST(StaticSolverClosedForm, AnInvertedRootIsNotTaken) {
  const CompressibleNeoHookean law = {0.48, 0.2};
  Model model;
  model.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  model.labels = {1, 2, 3, 4};
  model.materials.push_back({"TISSUE", law});
  model.elements.push_back({1, 0, 4, {0, 1, 2, 3}});
  for (int dof = 0; dof < 11; ++dof) model.fixed.push_back({dof / 3, dof % 3, 0.0});
  const double pressure = -10;
  LoadCase load = LoadCase::rest(model);
  load.force[11] = pressure / 6;  // volume 1/6 times the gradient 1
  const double sum_of_moduli = law.mu + law.lambda;
  const double linear = law.lambda + pressure;
  const double s = (linear + std::sqrt(linear * linear + 4 * sum_of_moduli * law.mu)) / (2 * sum_of_moduli);
  ASSERT_GT(s, 0);
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(12);
  const SolveReport report = solver.correct(load, u, exact());
  ASSERT_TRUE(report.converged);
  EXPECT_LT(report.history.front().step, 1.0) << "else this test shows nothing";
  EXPECT_NEAR(u[11], s - 1, kClosedForm);
}

}  // namespace static_solver_closed_forms_test
}  // namespace palpate
