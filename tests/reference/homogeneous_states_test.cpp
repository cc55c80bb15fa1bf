// The solver with every law, in elements of four and ten nodes, compared with closed forms in principal
// stretches. Both elements represent homogeneous deformations, so the error is the solver's tolerance and
// rounding.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>
#include <string>
#include <tuple>
#include <vector>

#include "offline/mesh/surface.hpp"
#include "tests/support/principal_stretch_laws.hpp"
#include "tests/support/scene_run.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace homogeneous_states_test {

using test::nodes_on_plane;
using test::PrincipalStretchLaw;
using test::SceneRun;
using test::SolverScene;

// Over the block's size for displacements, over the reaction for forces.
constexpr double kClosedForm = 1e-9;

const Eigen::Vector3d kSize(1.0, 1.25, 0.75);

// (index in principal_stretch_laws, nodes of an element)
using LawAndElement = std::tuple<int, int>;

const std::vector<PrincipalStretchLaw>& laws() {
  static const std::vector<PrincipalStretchLaw> all = test::principal_stretch_laws();
  return all;
}

class HomogeneousState : public ::testing::TestWithParam<LawAndElement> {
 protected:
  const PrincipalStretchLaw& law() const { return laws()[static_cast<std::size_t>(std::get<0>(GetParam()))]; }

  // Irregular inside, with straight edges. Four points do not integrate a curved ten-node element's gradients
  // (degree 3) exactly, so such elements pass the patch test only to second order of their curvature.
  Model block() const {
    test::BlockShape shape;
    shape.size = kSize;
    shape.law = law().law;
    const Model model = tetrahedral_block(shape);
    return std::get<1>(GetParam()) == 4 ? model : test::with_middle_nodes(model);
  }

  // Rollers on the planes x = 0, y = 0, z = 0; the opposite faces of the `driven` axes move to the stretch.
  SolverScene stretched(const std::vector<int>& driven, double stretch) const {
    SolverScene scene{block(), {}};
    LoadCase load = LoadCase::rest(scene.model);
    const auto hold = [&](const std::vector<int>& nodes, int axis, double value) {
      for (const int node : nodes) {
        load.held[static_cast<std::size_t>(3 * node + axis)] = 1;
        load.displacement[3 * node + axis] = value;
      }
    };
    for (int axis = 0; axis < 3; ++axis) hold(nodes_on_plane(scene.model, axis, 0.0), axis, 0.0);
    for (const int axis : driven)
      hold(nodes_on_plane(scene.model, axis, kSize[axis]), axis, (stretch - 1) * kSize[axis]);
    scene.steps = {load};
    return scene;
  }

  // The stretch of the free axes, along which the stress is zero. `stretches_of` places the stretch on the
  // axes.
  double free_stretch(int axis, const std::function<Eigen::Vector3d(double)>& stretches_of) const {
    double low = 0.5;
    double high = 2;
    for (int i = 0; i < 100; ++i) {
      const double middle = 0.5 * (low + high);
      (law().stresses(stretches_of(middle))[axis] < 0 ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }

  void expect_stretches(const SolverScene& scene, const std::vector<int>& driven,
                        const Eigen::Vector3d& stretches) const {
    const SceneRun run = test::run_scene(scene);
    ASSERT_TRUE(run.converged);
    const Eigen::VectorXd expected = test::affine_displacement(scene.model, stretches.asDiagonal());
    EXPECT_LE((run.displacement - expected).cwiseAbs().maxCoeff(), kClosedForm * kSize.maxCoeff());
    for (const int axis : driven) {
      const double reaction = law().stresses(stretches)[axis] * kSize.prod() / kSize[axis];
      const double found = test::sum_over(run.force, nodes_on_plane(scene.model, axis, kSize[axis]))[axis];
      EXPECT_NEAR(found, reaction, kClosedForm * std::abs(reaction));
      EXPECT_GT(std::abs(reaction), 0.1) << "else this test shows nothing";
    }
  }

  // Every surface node follows F, and the solver finds the inside. A homogeneous state has sum_a f_a X_a^T =
  // V P.
  void expect_patch(const Eigen::Matrix3d& F, const Eigen::Matrix3d& stress) const {
    SolverScene scene{block(), {}};
    const Model& model = scene.model;
    const Eigen::VectorXd expected = test::affine_displacement(model, F);
    LoadCase load = LoadCase::rest(model);
    const std::vector<int> surface = extract_surface(model).nodes;
    for (const int node : surface) test::hold_nodes(load, {node}, expected.segment<3>(3 * node));
    ASSERT_GE(model.num_nodes() - static_cast<int>(surface.size()), 8);
    scene.steps = {load};
    const SceneRun run = test::run_scene(scene);
    ASSERT_TRUE(run.converged);
    EXPECT_LE((run.displacement - expected).cwiseAbs().maxCoeff(), kClosedForm * kSize.maxCoeff());
    Eigen::Matrix3d dyad = Eigen::Matrix3d::Zero();
    for (int node = 0; node < model.num_nodes(); ++node)
      dyad += run.force.segment<3>(3 * node) * model.positions[static_cast<std::size_t>(node)].transpose();
    EXPECT_LE((dyad - kSize.prod() * stress).norm(), kClosedForm * dyad.norm());
  }
};

std::vector<int> indices() {
  std::vector<int> all(laws().size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

INSTANTIATE_TEST_SUITE_P(Solver, HomogeneousState,
                         ::testing::Combine(::testing::ValuesIn(indices()), ::testing::Values(4, 10)),
                         [](const auto& one) {
                           return laws()[static_cast<std::size_t>(std::get<0>(one.param))].name +
                                  (std::get<1>(one.param) == 4 ? "FourNodes" : "TenNodes");
                         });

TEST_P(HomogeneousState, UniaxialStretch) {
  for (const double s : {0.7, 1.4}) {
    SCOPED_TRACE(s);
    const auto stretches = [&](double a) { return Eigen::Vector3d(a, a, s); };
    expect_stretches(stretched({2}, s), {2}, stretches(free_stretch(0, stretches)));
  }
}

TEST_P(HomogeneousState, EquibiaxialStretch) {
  for (const double s : {0.8, 1.25}) {
    SCOPED_TRACE(s);
    const auto stretches = [&](double c) { return Eigen::Vector3d(s, s, c); };
    expect_stretches(stretched({0, 1}, s), {0, 1}, stretches(free_stretch(2, stretches)));
  }
}

// F = 1 + g e1 e2^T has the stretches l, 1/l, 1 with l = g/2 + sqrt(1 + g^2/4), along n_1 = (l, 1), n_2 =
// (-1, l) from N_1 = (1, l), N_2 = (-l, 1), all over sqrt(1 + l^2) (Ogden 1984, section 2.2.6). Small strain
// has P = mu g (e1 e2^T + e2 e1^T).
TEST_P(HomogeneousState, SimpleShear) {
  for (const double g : {0.2, 0.6}) {
    SCOPED_TRACE(g);
    Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
    F(0, 1) = g;
    Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();
    if (const LinearElastic* linear = std::get_if<LinearElastic>(&law().law)) {
      stress(0, 1) = stress(1, 0) = linear->mu * g;
    } else {
      const double l = 0.5 * g + std::sqrt(1 + 0.25 * g * g);
      const Eigen::Vector3d P = law().stresses({l, 1 / l, 1});
      stress = (P[0] * Eigen::Vector3d(l, 1, 0) * Eigen::RowVector3d(1, l, 0) +
                P[1] * Eigen::Vector3d(-1, l, 0) * Eigen::RowVector3d(-l, 1, 0)) /
               (1 + l * l);
      stress(2, 2) = P[2];
    }
    expect_patch(F, stress);
  }
}

// Three distinct stretches, with rotations on both sides for all laws but small strain.
TEST_P(HomogeneousState, ConstantStrainOfAPatch) {
  const Eigen::Vector3d stretches(1.3, 0.8, 1.1);
  Eigen::Matrix3d current = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d reference = Eigen::Matrix3d::Identity();
  if (!std::holds_alternative<LinearElastic>(law().law)) {
    current = test::rotation_about({1, 2, -1}, 0.3);
    reference = test::rotation_about({0, 1, 1}, 1.0);
  }
  expect_patch(current * stretches.asDiagonal() * reference.transpose(),
               current * law().stresses(stretches).asDiagonal() * reference.transpose());
}

}  // namespace homogeneous_states_test
}  // namespace palpate
