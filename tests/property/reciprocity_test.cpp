// Betti's theorem on the discrete body, for small motions about a large deformation. The force at A due to
// B's motion equals the force at B due to A's, because the forces have a potential.
#include "tests/support/reciprocity.hpp"

#include <gtest/gtest.h>

#include "tests/support/hard_scenes.hpp"

namespace palpate {
namespace reciprocity_test {

TEST(ReciprocityProperty, ForceAtADueToBIsForceAtBDueToA) {
  for (const bool ten_nodes : {false, true}) {
    test::BlockShape shape;
    shape.law = CompressibleNeoHookean{1, 4};
    Model block = test::tetrahedral_block(shape);
    if (ten_nodes) block = test::with_middle_nodes(block);
    const test::SolverScene scene = test::moved_top(block, {0.2, 0.1, -0.25});
    const test::SceneRun run = test::run_scene(scene);
    ASSERT_TRUE(run.converged);
    // On opposite sides, a third and two thirds up.
    const int a = test::nodes_on_plane(scene.model, 0, 0.0)[5];
    const int b = test::nodes_on_plane(scene.model, 0, 1.0)[9];
    const test::ReciprocalForces forces = test::reciprocal_forces(scene, run, a, b);
    const double own = forces.at_a_due_to_a.norm();
    EXPECT_GT(forces.at_a_due_to_b.norm(), 1e-4 * own) << "else this test shows nothing";
    EXPECT_GT((forces.at_a_due_to_b - forces.at_a_due_to_b.transpose()).norm(),
              1e-2 * forces.at_a_due_to_b.norm())
        << "of a matrix symmetric by itself this test shows nothing";
    // Relative to a node's own stiffness: rounding times the condition of K.
    EXPECT_LE((forces.at_a_due_to_b - forces.at_b_due_to_a.transpose()).norm(), 1e-12 * own);
  }
}

}  // namespace reciprocity_test
}  // namespace palpate
