// Pressure that follows its faces: force, tangent and work.
#include "offline/fem/surface_pressure.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "offline/fem/static_solver.hpp"
#include "offline/mesh/element_faces.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::test {
namespace surface_pressure_test {

// Every outer face of `model`, or only the faces in the plane z = top.
FacePressures on_outer_faces(const Model& model, double pressure, double top = -1) {
  FacePressures pressures;
  const std::vector<ElementFace> faces = sorted_faces(model);
  for (size_t i = 0; i < faces.size(); ++i) {
    const bool shared = (i > 0 && faces[i - 1].sorted == faces[i].sorted) ||
                        (i + 1 < faces.size() && faces[i + 1].sorted == faces[i].sorted);
    const bool in_plane = std::all_of(faces[i].sorted.begin(), faces[i].sorted.end(), [&](int node) {
      return model.positions[static_cast<size_t>(node)].z() == top;
    });
    if (!shared && (top < 0 || in_plane)) pressures[{faces[i].element, faces[i].face}] = pressure;
  }
  return pressures;
}

class SurfacePressure : public ::testing::TestWithParam<bool> {
 protected:
  SurfacePressure() {
    BlockShape shape;
    shape.cells = {2, 2, 2};
    model_ = tetrahedral_block(shape);
    if (GetParam()) model_ = with_middle_nodes(std::move(model_), 0.02);
    displacement_ = 0.05 * TestRandom(3).vector(model_.num_dofs());
  }
  Eigen::VectorXd force(const FacePressures& pressures, const Eigen::VectorXd& displacement) const {
    Eigen::VectorXd force = Eigen::VectorXd::Zero(model_.num_dofs());
    add_pressure_force(model_, pressures, displacement, force);
    return force;
  }

  Model model_;
  Eigen::VectorXd displacement_;
};

TEST_P(SurfacePressure, PushesIntoTheFaceWithItsArea) {
  BlockShape shape;
  shape.cells = {2, 3, 2};
  shape.size = {2.0, 3.0, 1.0};
  model_ = tetrahedral_block(shape);
  if (GetParam()) model_ = with_middle_nodes(std::move(model_));
  const Eigen::VectorXd pushed =
      force(on_outer_faces(model_, 0.7, 1.0), Eigen::VectorXd::Zero(model_.num_dofs()));
  const Eigen::Vector3d total = pushed.reshaped(3, model_.num_nodes()).rowwise().sum();
  EXPECT_NEAR((total - Eigen::Vector3d(0, 0, -0.7 * 6.0)).norm(), 0, 1e-13);
  for (int node = 0; node < model_.num_nodes(); ++node) {
    if (model_.positions[static_cast<size_t>(node)].z() < 1.0) {
      EXPECT_EQ(pushed.segment<3>(3 * node).norm(), 0);
    }
  }
}

TEST_P(SurfacePressure, AroundAClosedSurfaceCancels) {
  const FacePressures around = on_outer_faces(model_, 1.0);
  const Eigen::VectorXd pushed = force(around, displacement_);
  EXPECT_NEAR(pushed.reshaped(3, model_.num_nodes()).rowwise().sum().norm(), 0, 1e-13);
  EXPECT_GT(pushed.norm(), 0.1);
}

TEST_P(SurfacePressure, TangentIsTheGradient) {
  const Assembly assembly(model_, no_dofs(model_));
  const FacePressures top = on_outer_faces(model_, 0.7, 1.0);
  ASSERT_FALSE(top.empty());
  Assembly::SparseLower stiffness;
  assembly.tangent(displacement_, false, stiffness);
  const Eigen::MatrixXd without = Eigen::MatrixXd(stiffness).selfadjointView<Eigen::Lower>();
  subtract_pressure_tangent(assembly, top, displacement_, stiffness);
  const Eigen::MatrixXd with = Eigen::MatrixXd(stiffness).selfadjointView<Eigen::Lower>();

  // Forces are quadratic in the displacement, so central differences leave only rounding.
  Eigen::MatrixXd gradient(model_.num_dofs(), model_.num_dofs());
  for (int dof = 0; dof < model_.num_dofs(); ++dof) {
    Eigen::VectorXd ahead = displacement_;
    Eigen::VectorXd behind = displacement_;
    ahead[dof] += 0.5;
    behind[dof] -= 0.5;
    gradient.col(dof) = force(top, ahead) - force(top, behind);
  }
  const Eigen::MatrixXd symmetric = 0.5 * (gradient + gradient.transpose());
  EXPECT_GT(symmetric.norm(), 0.1);
  EXPECT_LE((without - with - symmetric).norm(), 1e-12 * without.norm());

  const Eigen::VectorXd vector = TestRandom(5).vector(model_.num_dofs());
  Eigen::VectorXd product = Eigen::VectorXd::Zero(model_.num_dofs());
  subtract_pressure_product(model_, top, displacement_, vector, product);
  EXPECT_GT(product.norm(), 0.01);
  EXPECT_LE((product + gradient * vector).norm(), 1e-12 * without.norm());
  EXPECT_GT(((gradient - symmetric) * vector).norm(), 0.01) << "else the rim of the patch is not there";
}

TEST_P(SurfacePressure, WorkIsForceTimesWay) {
  const FacePressures top = on_outer_faces(model_, 0.7, 1.0);
  const Eigen::VectorXd step = 0.1 * TestRandom(4).vector(model_.num_dofs());
  constexpr int kParts = 1000;
  double work = 0;
  for (int i = 0; i < kParts; ++i)
    work += force(top, displacement_ + (i + 0.5) / kParts * step).dot(step) / kParts;
  EXPECT_NEAR(pressure_work(model_, top, displacement_, step), work, 1e-6 * std::abs(work));
}

// A body in a fluid shrinks equally in all directions: mu (l^2 - 1) / J + lambda (J - 1) = -p, J = l^3, by
// eq. (2).
TEST_P(SurfacePressure, ABodyInAFluidShrinks) {
  const double mu = 0.48, lambda = 0.2, pressure = 0.3;
  double low = 0.2, high = 1.0;
  while (high - low > 1e-15) {
    const double l = 0.5 * (low + high), J = l * l * l;
    (mu * (l * l - 1) / J + lambda * (J - 1) < -pressure ? low : high) = l;
  }
  if (GetParam()) {  // three points do not integrate the pressure on bent faces exactly
    BlockShape shape;
    shape.cells = {2, 2, 2};
    model_ = with_middle_nodes(tetrahedral_block(shape));
  }
  // Supports at three corners hold the rigid motions and carry no force.
  Model model = model_;
  for (int node = 0; node < model.num_nodes(); ++node) {
    const Eigen::Vector3d& position = model.positions[static_cast<size_t>(node)];
    if (position.isZero()) model.fixed = {{node, 0, 0.0}, {node, 1, 0.0}, {node, 2, 0.0}};
  }
  for (int node = 0; node < model.num_nodes(); ++node) {
    const Eigen::Vector3d& position = model.positions[static_cast<size_t>(node)];
    if (position == Eigen::Vector3d::UnitX())
      model.fixed.insert(model.fixed.end(), {{node, 1, 0.0}, {node, 2, 0.0}});
    if (position == Eigen::Vector3d::UnitY()) model.fixed.push_back({node, 2, 0.0});
  }
  const Assembly assembly(model, no_dofs(model));
  StaticSolver solver(assembly);
  LoadCase load = LoadCase::rest(model);
  load.pressures = on_outer_faces(model, pressure);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  SolverSettings settings;
  settings.reuse_contraction = 0;
  settings.first_increment = 0.5;
  const SolveReport report = solver.ramp(LoadCase::rest(model), load, u, settings);
  ASSERT_TRUE(report.converged);
  const Eigen::VectorXd exact = affine_displacement(model, low * Eigen::Matrix3d::Identity());
  EXPECT_LE((u - exact).norm(), 1e-9 * exact.norm());
  // Newton is quadratic: each residual is about the square of the residual before.
  const IterationRecord& last = report.history.back();
  const IterationRecord& before = report.history[report.history.size() - 2];
  EXPECT_LE(last.residual, 10 * before.residual * before.residual + 1e-14);
}

// At the boundary of a pressed patch the tangent is not symmetric; Newton stays quadratic.
TEST_P(SurfacePressure, NewtonIsQuadraticBesideAFreeRim) {
  const Model model = with_fixed_base(model_);
  const Assembly assembly(model, no_dofs(model));
  StaticSolver solver(assembly);
  LoadCase load = LoadCase::rest(model);
  load.pressures = on_outer_faces(model, 0.1, 1.0);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  SolverSettings settings;
  settings.reuse_contraction = 0;
  const SolveReport report = solver.ramp(LoadCase::rest(model), load, u, settings);
  ASSERT_TRUE(report.converged);
  EXPECT_LE(report.iterations, 6);
  const IterationRecord& last = report.history.back();
  const IterationRecord& before = report.history[report.history.size() - 2];
  EXPECT_LE(last.residual, 10 * before.residual * before.residual + 1e-14);
}

// From a pressure on a face to a pressure on another face: half way both act at half their size. The order of
// the steps does not change the end.
TEST(SurfacePressureSolve, PressuresOfOneStepGiveWayToThoseOfTheNext) {
  BlockShape shape;
  shape.cells = {3, 3, 3};
  const Model model = with_fixed_base(tetrahedral_block(shape));
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase rest = LoadCase::rest(model);
  LoadCase first = rest;
  first.pressures = on_outer_faces(model, 0.1, 1.0);
  LoadCase second = rest;
  FacePressures all = on_outer_faces(model, -0.05);
  for (const auto& [face, pressure] : first.pressures) all.erase(face);
  second.pressures = all;
  SolverSettings settings;
  settings.first_increment = 0.5;
  settings.largest_increment = 0.5;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  ASSERT_TRUE(solver.ramp(rest, first, u, settings).converged);

  Eigen::VectorXd stopped = u;
  SolverSettings one = settings;
  one.max_increments = 1;
  EXPECT_FALSE(solver.ramp(first, second, stopped, one).converged);
  LoadCase half = rest;
  for (const auto& [face, pressure] : first.pressures) half.pressures[face] += 0.5 * pressure;
  for (const auto& [face, pressure] : second.pressures) half.pressures[face] += 0.5 * pressure;
  Eigen::VectorXd at_half = Eigen::VectorXd::Zero(model.num_dofs());
  ASSERT_TRUE(solver.ramp(rest, half, at_half, settings).converged);
  EXPECT_LE((stopped - at_half).norm(), 1e-8 * at_half.norm());

  ASSERT_TRUE(solver.ramp(first, second, u, settings).converged);
  Eigen::VectorXd direct = Eigen::VectorXd::Zero(model.num_dofs());
  ASSERT_TRUE(solver.ramp(rest, second, direct, settings).converged);
  EXPECT_LE((u - direct).norm(), 1e-8 * direct.norm());
  EXPECT_GT((u - stopped).norm(), 0.1 * u.norm());
}

// The suction makes the symmetric part of the tangent indefinite, while the equilibrium is regular. For the
// same cube (one cell, NEO HOOKE with C10 = 1000, D1 = 0.001, suction 4000 on top) CalculiX 2.20 finds
// displacements up to 1.220194.
TEST(SurfacePressureSolve, AnIndefiniteSymmetricPartDoesNotStopIt) {
  BlockShape shape;
  shape.cells = {1, 1, 1};
  InvariantLaw law;
  law.c10 = 1000;
  law.volumetric.inverse_d[0] = 1000;
  shape.law = law;
  const Model model = with_fixed_base(tetrahedral_block(shape));
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  LoadCase load = LoadCase::rest(model);
  load.pressures = on_outer_faces(model, -4000, 1.0);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  SolverSettings settings;
  settings.first_increment = 0.1;
  const SolveReport report = solver.ramp(LoadCase::rest(model), load, u, settings);
  ASSERT_TRUE(report.converged);
  EXPECT_FALSE(solver.factorize_at(load, u, false)) << "else this test shows nothing";
  EXPECT_NEAR(u[3 * 4 + 2], 1.220194, 2e-6);
  EXPECT_LE(report.iterations, 80);
}

INSTANTIATE_TEST_SUITE_P(Faces, SurfacePressure, ::testing::Bool(),
                         [](const auto& kind) { return kind.param ? "SixNodes" : "ThreeNodes"; });

}  // namespace surface_pressure_test
}  // namespace palpate::test
