// The discrete equations: force = gradient of the energy, tangent = gradient of the force, rigid motions cost
// nothing.
#include <gtest/gtest.h>

#include "offline/numerics/decompositions.hpp"
#include "tests/support/assembly_fixture.hpp"

namespace palpate::assembly_fixture {
namespace assembly_test {

// Properties of every kind of element. Ten-node elements have curved edges here.
class AssemblyOfEachKind : public ::testing::TestWithParam<Kind> {};

INSTANTIATE_TEST_SUITE_P(Assembly, AssemblyOfEachKind, ::testing::ValuesIn(kKinds), [](const auto& one) {
  return std::string(has_ten_nodes(one.param) ? "TenNodes" : "FourNodes") +
         (shares_volume(one.param) ? "SharingVolume" : "");
});

TEST_P(AssemblyOfEachKind, ForceIsTheGradientOfTheEnergy) {
  const Model model = several_materials(GetParam());
  const Assembly assembly(model, no_dofs(model));
  const Eigen::VectorXd displacement = distorted(model);
  Eigen::VectorXd force;
  const ElementState state = assembly.internal_force(displacement, force);
  ASSERT_GT(state.min_jacobian, 0.1);
  ASSERT_EQ(force.size(), model.num_dofs());
  for (int dof = 0; dof < model.num_dofs(); ++dof) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(model.num_dofs(), dof);
    const double slope =
        (stored_energy(assembly, displacement + step) - stored_energy(assembly, displacement - step)) /
        (2 * kStep);
    EXPECT_NEAR(force[dof], slope, kDifference * force.cwiseAbs().maxCoeff()) << "dof " << dof;
  }
}

TEST_P(AssemblyOfEachKind, TangentIsTheGradientOfTheForce) {
  const Model model = several_materials(GetParam());
  const Assembly assembly(model, no_dofs(model));
  const Eigen::VectorXd displacement = distorted(model);
  const int n = model.num_dofs();
  Assembly::SparseLower lower;
  assembly.tangent(displacement, false, lower);
  const Eigen::MatrixXd stiffness = dense_of(lower);
  const double scale = stiffness.cwiseAbs().maxCoeff();

  const Eigen::MatrixXd columns = assembly.tangent_times(displacement, Eigen::MatrixXd::Identity(n, n));
  EXPECT_LE((columns - stiffness).cwiseAbs().maxCoeff(), kRounding * scale);

  Eigen::VectorXd forward;
  Eigen::VectorXd backward;
  for (int dof = 0; dof < n; ++dof) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(n, dof);
    assembly.internal_force(displacement + step, forward);
    assembly.internal_force(displacement - step, backward);
    const Eigen::VectorXd column = (forward - backward) / (2 * kStep);
    EXPECT_LE((column - stiffness.col(dof)).cwiseAbs().maxCoeff(), kDifference * scale) << "dof " << dof;
  }
}

TEST_P(AssemblyOfEachKind, TangentKeepsOnePatternForAllStates) {
  const Model model = several_materials(GetParam());
  const Assembly assembly(model, no_dofs(model));
  Assembly::SparseLower rest;
  assembly.tangent(Eigen::VectorXd::Zero(model.num_dofs()), false, rest);
  Assembly::SparseLower later;
  assembly.tangent(distorted(model), true, later);
  ASSERT_TRUE(rest.isCompressed());
  ASSERT_EQ(rest.nonZeros(), later.nonZeros());
  for (Eigen::Index i = 0; i < rest.nonZeros(); ++i)
    EXPECT_EQ(rest.innerIndexPtr()[i], later.innerIndexPtr()[i]);
  for (int column = 0; column < rest.cols(); ++column) {
    int before = column - 1;
    for (Assembly::SparseLower::InnerIterator it(rest, column); it; ++it) {
      EXPECT_GT(it.row(), before) << "lower triangle, ascending";
      before = static_cast<int>(it.row());
    }
  }
  // A second state in the same matrix keeps nothing of the first state.
  assembly.tangent(Eigen::VectorXd::Zero(model.num_dofs()), false, later);
  EXPECT_EQ((dense_of(later) - dense_of(rest)).norm(), 0.0);
}

TEST_P(AssemblyOfEachKind, ProjectedTangentHasNoNegativeEigenvalue) {
  const Model model = several_materials(GetParam());
  const Assembly assembly(model, no_dofs(model));
  // Compressed to 0.6: the pressure makes rotations, and so the tangent, unstable.
  const Eigen::VectorXd squeezed = affine_displacement(model, 0.6 * Eigen::Matrix3d::Identity()) +
                                   0.01 * TestRandom(6).vector(model.num_dofs());
  Assembly::SparseLower lower;
  assembly.tangent(squeezed, false, lower);
  const Eigen::MatrixXd exact = dense_of(lower);
  assembly.tangent(squeezed, true, lower);
  const Eigen::MatrixXd projected = dense_of(lower);
  const auto lowest = [](const Eigen::MatrixXd& matrix) { return symmetric_modes(matrix).values(0); };
  const double scale = projected.cwiseAbs().maxCoeff();
  ASSERT_LT(lowest(exact), -1e-3 * scale) << "else this test shows nothing";
  EXPECT_GE(lowest(projected), -kRounding * scale);
  EXPECT_GE(lowest(projected - exact), -kRounding * scale) << "projection only takes negative parts away";
}

TEST_P(AssemblyOfEachKind, ProjectionLeavesAPositiveTangentAlone) {
  const Model model = several_materials(GetParam());
  const Assembly assembly(model, no_dofs(model));
  // A slight stretch: tension stabilises rotations. A large stretch softens a law with large lambda in shear.
  const Eigen::VectorXd stretched = affine_displacement(model, 1.03 * rotation_about({1, -1, 2}, 0.7)) +
                                    0.002 * TestRandom(7).vector(model.num_dofs());
  Assembly::SparseLower exact;
  Assembly::SparseLower projected;
  assembly.tangent(stretched, false, exact);
  assembly.tangent(stretched, true, projected);
  // Elements that share volumes have zero-energy modes at a point; rounding makes some slightly negative.
  const double allowed = shares_volume(GetParam()) ? kRounding * exact.norm() : 0.0;
  EXPECT_LE((dense_of(exact) - dense_of(projected)).norm(), allowed);
}

// Enough elements to occupy every number of threads.
TEST_P(AssemblyOfEachKind, ThreadsDoNotChangeABit) {
  BlockShape shape;
  shape.cells = {14, 14, 14};
  const Model model = in_kind(GetParam(), tetrahedral_block(shape));
  const Eigen::VectorXd displacement = 0.005 * TestRandom(9).vector(model.num_dofs());
  const Assembly alone(model, no_dofs(model));
  Eigen::VectorXd force;
  double energy = 0;
  const ElementState state = alone.internal_force(displacement, force, &energy);
  Assembly::SparseLower stiffness;
  alone.tangent(displacement, false, stiffness);
  for (const int threads : {2, 3, 7}) {
    const Assembly together(model, no_dofs(model), threads);
    Eigen::VectorXd other_force;
    double other_energy = 0;
    const ElementState other = together.internal_force(displacement, other_force, &other_energy);
    EXPECT_EQ(other_force, force);
    EXPECT_EQ(other_energy, energy);
    EXPECT_EQ(other.min_jacobian, state.min_jacobian);
    EXPECT_EQ(other.worst_element, state.worst_element);
    Assembly::SparseLower other_stiffness;
    together.tangent(displacement, false, other_stiffness);
    EXPECT_TRUE(std::equal(stiffness.valuePtr(), stiffness.valuePtr() + stiffness.nonZeros(),
                           other_stiffness.valuePtr()));
  }
}

TEST_P(AssemblyOfEachKind, RigidMotionsCostNothing) {
  const Model model = several_materials(GetParam());
  const Assembly assembly(model, no_dofs(model));
  Assembly::SparseLower lower;
  assembly.tangent(Eigen::VectorXd::Zero(model.num_dofs()), false, lower);
  const double stiffest = dense_of(lower).cwiseAbs().maxCoeff();
  TestRandom random(8);
  for (const double angle : {0.0, 1e-3, 0.5, 2.0, 3.14159}) {
    const Eigen::Matrix3d Q = rotation_about(random.vector(), angle);
    Eigen::VectorXd displacement = affine_displacement(model, Q);
    for (int node = 0; node < model.num_nodes(); ++node)
      displacement.segment<3>(3 * node) += Eigen::Vector3d(3, -2, 5);
    Eigen::VectorXd force;
    const ElementState state = assembly.internal_force(displacement, force);
    // Rounding of displacements of five block sizes.
    EXPECT_LE(force.cwiseAbs().maxCoeff(), 1e-13 * stiffest) << "angle " << angle;
    EXPECT_NEAR(state.min_jacobian, 1.0, 1e-13);
    EXPECT_NEAR(stored_energy(assembly, displacement), 0.0, 1e-13 * stiffest);
    // The tangent rotates with the body: K (Q v) = Q K v for every v; here for a random v.
    const Eigen::MatrixXd v = TestRandom(9).matrix(model.num_dofs(), 1);
    const auto turned = [&](const Eigen::MatrixXd& column) {
      return Eigen::MatrixXd((Q * column.reshaped(3, model.num_nodes())).reshaped());
    };
    const Eigen::MatrixXd at_rest = assembly.tangent_times(Eigen::VectorXd::Zero(model.num_dofs()), v);
    EXPECT_LE((assembly.tangent_times(displacement, turned(v)) - turned(at_rest)).cwiseAbs().maxCoeff(),
              1e-12 * stiffest)
        << "angle " << angle;
  }
}

TEST_P(AssemblyOfEachKind, ForcesSumToZeroInEveryState) {
  const Model model = several_materials(GetParam());
  const Assembly assembly(model, no_dofs(model));
  const Eigen::VectorXd displacement = distorted(model);
  Eigen::VectorXd force;
  assembly.internal_force(displacement, force);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (int node = 0; node < model.num_nodes(); ++node) {
    const Eigen::Vector3d at = model.positions[static_cast<size_t>(node)] + displacement.segment<3>(3 * node);
    const Eigen::Vector3d f = force.segment<3>(3 * node);
    sum += f;
    moment += Eigen::Vector3d(at.y() * f.z() - at.z() * f.y(), at.z() * f.x() - at.x() * f.z(),
                              at.x() * f.y() - at.y() * f.x());
  }
  EXPECT_LE(sum.norm(), kRounding * force.norm());
  EXPECT_LE(moment.norm(), kRounding * force.norm());
}

}  // namespace assembly_test
}  // namespace palpate::assembly_fixture
