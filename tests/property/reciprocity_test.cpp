// Betti's theorem on the discrete body, small motions about a large deformation: what A feels when B moves is
// what B feels when A does. It holds because the forces have a potential.
#include <gtest/gtest.h>

#include "tests/support/hard_scenes.hpp"

namespace palpate {
namespace {

TEST(ReciprocityProperty, ForceAtADueToBIsForceAtBDueToA) {
  for (const bool ten_nodes : {false, true}) {
    test::BlockShape shape;
    shape.law = CompressibleNeoHookean{1, 4};
    Model block = test::tetrahedral_block(shape);
    if (ten_nodes) block = test::with_middle_nodes(block);
    const test::SolverScene scene = test::moved_top(block, {0.2, 0.1, -0.25});
    const test::SceneRun run = test::run_scene(scene);
    ASSERT_TRUE(run.converged);

    // Two surface nodes of opposite sides, half way up, are held where they are and moved one after the
    // other.
    const int a = test::nodes_on_plane(scene.model, 0, 0.0)[5];
    const int b = test::nodes_on_plane(scene.model, 0, 1.0)[9];
    LoadCase load = scene.steps.back();
    test::hold_nodes(load, {a}, run.displacement.segment<3>(3 * a));
    test::hold_nodes(load, {b}, run.displacement.segment<3>(3 * b));
    Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(scene.model.num_dofs(), 6);
    directions.block<3, 3>(3 * a, 0).setIdentity();
    directions.block<3, 3>(3 * b, 3).setIdentity();
    const Assembly assembly(scene.model, scene.model.fixed_dofs());
    StaticSolver solver(assembly);
    Eigen::MatrixXd response;
    ASSERT_TRUE(solver.tangent_response(load, run.displacement, directions, response));
    const Eigen::MatrixXd force = assembly.tangent_times(run.displacement, response);
    const Eigen::Matrix3d at_a_due_to_b = force.block<3, 3>(3 * a, 3);
    const Eigen::Matrix3d at_b_due_to_a = force.block<3, 3>(3 * b, 0);
    const double own = force.block<3, 3>(3 * a, 0).norm();
    EXPECT_GT(at_a_due_to_b.norm(), 1e-4 * own) << "else this test shows nothing";
    EXPECT_GT((at_a_due_to_b - at_a_due_to_b.transpose()).norm(), 1e-2 * at_a_due_to_b.norm())
        << "of a matrix symmetric by itself this test shows nothing";
    // 1e-12 of what moves the node itself: rounding times the condition of K.
    EXPECT_LE((at_a_due_to_b - at_b_due_to_a.transpose()).norm(), 1e-12 * own);
  }
}

}  // namespace
}  // namespace palpate
