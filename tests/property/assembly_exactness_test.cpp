// Assembly: states that finite elements represent exactly, and states that assembly refuses.
#include <gtest/gtest.h>

#include "offline/material/constitutive_response.hpp"
#include "offline/numerics/decompositions.hpp"
#include "tests/support/assembly_fixture.hpp"

namespace palpate::assembly_fixture {
namespace assembly_exactness_test {

TEST(AssemblyProperty, ProjectionOfOneElementLeavesTheOthers) {
  BlockShape shape;
  shape.cells = {3, 3, 3};
  const Model model = tetrahedral_block(shape);
  const Assembly assembly(model, no_dofs(model));
  // A slight stretch everywhere, and a corner node pushed into its elements.
  Eigen::VectorXd displacement = affine_displacement(model, 1.15 * Eigen::Matrix3d::Identity());
  displacement.head<3>() += Eigen::Vector3d::Constant(0.15);
  Assembly::SparseLower exact;
  Assembly::SparseLower projected;
  assembly.tangent(displacement, false, exact);
  assembly.tangent(displacement, true, projected);
  const Eigen::MatrixXd difference = dense_of(projected) - dense_of(exact);
  ASSERT_GT(difference.norm(), 1e-3 * exact.norm()) << "else this test shows nothing";
  std::vector<char> beside(static_cast<size_t>(model.num_nodes()), 0);
  for (const Tetrahedron& element : model.elements) {
    if (std::find(element.nodes().begin(), element.nodes().end(), 0) == element.nodes().end()) continue;
    for (const int node : element.nodes()) beside[static_cast<size_t>(node)] = 1;
  }
  for (int dof = 0; dof < model.num_dofs(); ++dof) {
    if (!beside[static_cast<size_t>(dof / 3)]) {
      EXPECT_EQ(difference.col(dof).norm(), 0.0);
    }
  }
}

// Patch test: a constant F gives the law's stress everywhere and no force on inner nodes.
TEST(AssemblyProperty, ConstantStrainIsExact) {
  for (const Kind kind : kKinds) {
    BlockShape shape;
    shape.cells = {2, 2, 2};
    const Model model = in_kind(kind, tetrahedral_block(shape));
    const Assembly assembly(model, no_dofs(model));
    const Eigen::Matrix3d F = rotation_about({1, 2, -1}, 0.4) * Eigen::Vector3d(1.3, 0.8, 1.1).asDiagonal() *
                              rotation_about({0, 1, 1}, 1.0);
    Eigen::VectorXd force;
    double energy = 0;
    assembly.internal_force(affine_displacement(model, F), force, &energy);
    const Law& law = model.materials[0].law;
    EXPECT_NEAR(energy, strain_energy_density(law, F), 1e-13 * energy) << "of a unit volume";
    for (int node = 0; node < model.num_nodes(); ++node) {
      const Eigen::Vector3d& x = model.positions[static_cast<size_t>(node)];
      const bool inside = x.minCoeff() > 1e-9 && x.maxCoeff() < 1 - 1e-9;
      if (inside) {
        EXPECT_LE(force.segment<3>(3 * node).norm(), 1e-13 * force.norm());
      }
    }
    // The virial of the forces, sum of f X^T, is the volume times P.
    Eigen::Matrix3d virial = Eigen::Matrix3d::Zero();
    for (int node = 0; node < model.num_nodes(); ++node)
      virial += force.segment<3>(3 * node) * model.positions[static_cast<size_t>(node)].transpose();
    EXPECT_LE((virial - first_piola_kirchhoff(law, F)).norm(), 1e-13 * virial.norm());
  }
}

// Ten-node elements contain quadratic displacements, so small-strain energy is exact. For u = (a z^2, 0, 0)
// on the unit cube, e_xz = a z and the energy is the integral of 2 mu e_xz^2, 2/3 mu a^2.
TEST(AssemblyProperty, TenNodesBendExactly) {
  BlockShape shape;
  shape.cells = {1, 1, 1};
  shape.law = LinearElastic{1.0, 2.0};
  const Model model = test::with_middle_nodes(tetrahedral_block(shape));
  const Assembly assembly(model, no_dofs(model));
  Eigen::VectorXd displacement = Eigen::VectorXd::Zero(model.num_dofs());
  constexpr double kBend = 0.3;
  for (int node = 0; node < model.num_nodes(); ++node)
    displacement[3 * node] = kBend * std::pow(model.positions[static_cast<size_t>(node)].z(), 2);
  EXPECT_NEAR(stored_energy(assembly, displacement), 2.0 / 3.0 * kBend * kBend, 1e-14);
}

TEST(AssemblyProperty, OriginDoesNotMatter) {
  BlockShape shape;
  shape.cells = {2, 2, 2};
  const Model near = tetrahedral_block(shape);  // size 1, coordinates on a grid of 2^-20
  const Eigen::VectorXd displacement = distorted(near);
  const Assembly near_assembly(near, no_dofs(near));
  Eigen::VectorXd near_force;
  near_assembly.internal_force(displacement, near_force);
  const auto force_at = [&](const Eigen::Vector3d& origin) {
    Model far = near;
    for (Eigen::Vector3d& position : far.positions) position += origin;
    Eigen::VectorXd force;
    const Assembly assembly(far, no_dofs(far));
    assembly.internal_force(displacement, force);
    return force;
  };
  // A shift without rounding of coordinates changes no bit.
  EXPECT_EQ((force_at({8192, -16384, 4096}) - near_force).norm(), 0.0);
  // Coordinates of 1e4 are rounded at 1e-12; edges are about 0.5.
  EXPECT_LE((force_at({1.1e4, 0.7e4, -1.3e4}) - near_force).norm(), 1e-10 * near_force.norm());
}

// In a state with zero exact force, the remainder is rounding: below the stated bound, and above a thousandth
// of the bound.
TEST(AssemblyProperty, RoundingIsAsSmallAsSaid) {
  for (const double stiffness : {1.0, 1e6}) {
    BlockShape shape;
    shape.law = CompressibleNeoHookean{0.48, 0.2 * stiffness};
    const Model model = tetrahedral_block(shape);
    const Assembly assembly(model, no_dofs(model));
    for (const double far : {0.0, 1e3}) {
      const Eigen::Matrix3d Q = rotation_about({1, 2, -1}, 0.4);
      Eigen::VectorXd displacement = affine_displacement(model, Q);
      for (int node = 0; node < model.num_nodes(); ++node)
        displacement.segment<3>(3 * node) += far * Eigen::Vector3d(1, -0.7, 0.3);
      Eigen::VectorXd force;
      assembly.internal_force(displacement, force);
      EXPECT_LE(force.norm(), 2 * assembly.rounding_force(displacement)) << stiffness << " " << far;
      EXPECT_GE(force.norm(), 1e-3 * assembly.rounding_force(displacement)) << stiffness << " " << far;
    }
  }
}

TEST(AssemblyProperty, EliminatedDofsLeaveTheEquations) {
  const Model model = test::with_fixed_base(several_materials());
  const std::vector<char> eliminated = model.fixed_dofs();
  const Assembly whole(model, no_dofs(model));
  const Assembly reduced(model, eliminated);
  EXPECT_EQ(whole.num_equations(), model.num_dofs());
  EXPECT_EQ(reduced.num_equations(), model.num_dofs() - static_cast<int>(model.fixed.size()));
  for (int dof = 0; dof < model.num_dofs(); ++dof) {
    const int equation = reduced.dof_equations()[static_cast<size_t>(dof)];
    if (eliminated[static_cast<size_t>(dof)]) {
      EXPECT_EQ(equation, -1);
    } else {
      ASSERT_GE(equation, 0);
      EXPECT_EQ(reduced.equation_dofs()[static_cast<size_t>(equation)], dof);
    }
  }
  const Eigen::VectorXd displacement = distorted(model);
  Assembly::SparseLower lower;
  whole.tangent(displacement, false, lower);
  const Eigen::MatrixXd all = dense_of(lower);
  Assembly::SparseLower reduced_lower;
  reduced.tangent(displacement, false, reduced_lower);
  EXPECT_EQ((dense_of(reduced_lower) - all(reduced.equation_dofs(), reduced.equation_dofs())).norm(), 0.0);
  // At eliminated dofs the internal forces are the reactions.
  Eigen::VectorXd force;
  Eigen::VectorXd reduced_force;
  whole.internal_force(displacement, force);
  reduced.internal_force(displacement, reduced_force);
  EXPECT_EQ((force - reduced_force).norm(), 0.0);
}

TEST(AssemblyProperty, ANodeWithoutElementHasNoEquation) {
  Model model = several_materials();
  const Assembly without(model, no_dofs(model));
  model.positions.insert(model.positions.begin(), Eigen::Vector3d(0.5, 0.5, 0.5));
  model.labels.insert(model.labels.begin(), 999);
  for (Tetrahedron& element : model.elements) {
    for (int& node : element.nodes()) ++node;
  }
  const Assembly with(model, no_dofs(model));
  EXPECT_EQ(with.num_equations(), without.num_equations());
  for (size_t dof = 0; dof < 3; ++dof) EXPECT_EQ(with.dof_equations()[dof], -1);
  Eigen::VectorXd displacement = Eigen::VectorXd::Zero(model.num_dofs());
  displacement.head<3>() << 7, 8, 9;
  Eigen::VectorXd force;
  const ElementState state = with.internal_force(displacement, force);
  EXPECT_EQ(force.norm(), 0.0);
  EXPECT_NEAR(state.min_jacobian, 1.0, 1e-15);
  EXPECT_EQ(with.tangent_times(displacement, Eigen::MatrixXd::Identity(model.num_dofs(), 3)).norm(), 0.0);
}

TEST(AssemblyProperty, AnInvertedElementIsNamed) {
  BlockShape shape;
  shape.cells = {1, 1, 1};
  const Model model = tetrahedral_block(shape);
  const Assembly assembly(model, no_dofs(model));
  // Corner 5, at (1, 0, 1), belongs to the elements 0 4 5 7 and 0 5 1 7.
  std::vector<int> around;
  for (size_t e = 0; e < model.elements.size(); ++e) {
    const auto nodes = model.elements[e].nodes();
    if (std::find(nodes.begin(), nodes.end(), 5) != nodes.end()) around.push_back(static_cast<int>(e));
  }
  ASSERT_EQ(around, (std::vector<int>{4, 5}));
  // Moved straight down, corner 5 keeps its distance from the plane x = y of 0 4 7 and crosses the plane y =
  // z of 0 1 7.
  Eigen::VectorXd displacement = Eigen::VectorXd::Zero(model.num_dofs());
  displacement.segment<3>(15) = Eigen::Vector3d(0, 0, -1.5);  // z = -0.5 < y = 0
  Eigen::VectorXd force;
  const ElementState state = assembly.internal_force(displacement, force);
  EXPECT_EQ(state.worst_element, 5);
  EXPECT_NEAR(state.min_jacobian, -0.5, 1e-14) << "the height over that face went from 1 to -1/2";
  EXPECT_EQ(stored_energy(assembly, displacement), std::numeric_limits<double>::infinity());
  // A flat element and a NaN count as inverted.
  displacement[17] = -1.0;
  EXPECT_EQ(stored_energy(assembly, displacement), std::numeric_limits<double>::infinity());
  EXPECT_LE(assembly.internal_force(displacement, force).min_jacobian, 0.0);
  displacement[17] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(stored_energy(assembly, displacement), std::numeric_limits<double>::infinity());
  EXPECT_FALSE(assembly.internal_force(displacement, force).min_jacobian > 0);
}

// Energy, force and tangent of a law with tr F, not det F, as measure of volume.
TEST(AssemblyProperty, HookesLawSharesTheTrace) {
  for (const Law& law : {Law(LinearElastic{1.0, 30.0}), Law(StVenantKirchhoff{1.0, 30.0})}) {
    BlockShape shape;
    shape.cells = {2, 1, 1};
    shape.law = law;
    const Model model = in_kind(Kind::four_nodes_sharing, tetrahedral_block(shape));
    const Assembly assembly(model, no_dofs(model));
    const Eigen::VectorXd displacement = 0.1 * TestRandom(11).vector(model.num_dofs());
    Eigen::VectorXd force;
    assembly.internal_force(displacement, force);
    Assembly::SparseLower lower;
    assembly.tangent(displacement, false, lower);
    const Eigen::MatrixXd stiffness = dense_of(lower);
    for (int dof = 0; dof < model.num_dofs(); ++dof) {
      const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(model.num_dofs(), dof);
      const double slope =
          (stored_energy(assembly, displacement + step) - stored_energy(assembly, displacement - step)) /
          (2 * kStep);
      EXPECT_NEAR(force[dof], slope, kDifference * force.cwiseAbs().maxCoeff()) << "dof " << dof;
      Eigen::VectorXd forward;
      Eigen::VectorXd backward;
      assembly.internal_force(displacement + step, forward);
      assembly.internal_force(displacement - step, backward);
      EXPECT_LE(((forward - backward) / (2 * kStep) - stiffness.col(dof)).cwiseAbs().maxCoeff(),
                kDifference * stiffness.cwiseAbs().maxCoeff())
          << "dof " << dof;
    }
  }
}

// The energy equals the sum in shared_volumes.hpp. Patches of single elements give the energy of C3D4.
TEST(AssemblyProperty, SharedVolumesStoreTheMeansEnergy) {
  const Model apart = several_materials();
  Model alone = apart;
  for (size_t e = 0; e < alone.elements.size(); ++e) alone.elements[e].volume_patch = static_cast<int>(e);
  const Eigen::VectorXd displacement = distorted(apart);
  const auto answer = [&](const Model& model) {
    const Assembly assembly(model, no_dofs(model));
    Eigen::VectorXd force;
    double energy = 0;
    assembly.internal_force(displacement, force, &energy);
    return std::pair(energy, force);
  };
  const auto [energy_apart, force_apart] = answer(apart);
  const auto [energy_alone, force_alone] = answer(alone);
  EXPECT_NEAR(energy_alone, energy_apart, kRounding * energy_apart);
  EXPECT_LE((force_alone - force_apart).norm(), 10 * kRounding * force_apart.norm());

  const double lambda = 50;
  BlockShape shape;
  shape.cells = {2, 2, 2};
  shape.law = CompressibleNeoHookean{1, lambda};
  const Model model = in_kind(Kind::four_nodes_sharing, tetrahedral_block(shape));
  ASSERT_GT(count_volume_patches(model).fewest_elements, 1);
  const Eigen::VectorXd bent = 0.05 * TestRandom(12).vector(model.num_dofs());
  double expected = 0;
  std::map<int, std::pair<double, double>> patches;  // volumes at rest and in the current configuration
  for (const Tetrahedron& element : model.elements) {
    Eigen::Matrix3d rest;
    Eigen::Matrix3d now;
    for (int a = 0; a < 3; ++a) {
      const auto at = [&](int node) { return model.positions[static_cast<size_t>(node)]; };
      const int first = element.node_array[0];
      const int other = element.node_array[static_cast<size_t>(a) + 1];
      rest.col(a) = at(other) - at(first);
      now.col(a) = rest.col(a) + bent.segment<3>(3 * other) - bent.segment<3>(3 * first);
    }
    const Eigen::Matrix3d F = now * rest.inverse();
    const double volume = rest.determinant() / 6;
    expected += volume * 0.5 * (F.squaredNorm() - 3 - 2 * std::log(F.determinant()));
    auto& [before, after] = patches[element.volume_patch];
    before += volume;
    after += volume * F.determinant();
  }
  for (const auto& [number, volumes] : patches)
    expected += 0.5 * lambda * volumes.first * std::pow(volumes.second / volumes.first - 1, 2);
  const Assembly assembly(model, no_dofs(model));
  EXPECT_NEAR(stored_energy(assembly, bent), expected, kRounding * expected);
}

// A patch has no spurious soft mode: the softest mode costs at least as much as in a tissue with lambda = 0.
TEST(AssemblyProperty, SharedVolumesHaveNoSoftModes) {
  const auto softest = [](Kind kind, double bulk) {
    BlockShape shape;
    shape.cells = {3, 3, 3};
    InvariantLaw law;
    law.c10 = 0.5;
    law.volumetric.inverse_d[0] = 0.5 * bulk;
    shape.law = law;
    const Model model = test::with_fixed_base(in_kind(kind, tetrahedral_block(shape)));
    const Assembly assembly(model, model.fixed_dofs());
    Assembly::SparseLower lower;
    assembly.tangent(Eigen::VectorXd::Zero(model.num_dofs()), false, lower);
    return symmetric_modes(dense_of(lower)).values[0];
  };
  const double compressible = softest(Kind::four_nodes, 2.0 / 3.0);  // mu = 1, lambda = 0
  EXPECT_GE(softest(Kind::four_nodes_sharing, 2.0 / 3.0), 0.9 * compressible);
  EXPECT_GE(softest(Kind::four_nodes_sharing, 5e3), compressible);
  EXPECT_GE(softest(Kind::ten_nodes_sharing, 5e3), 0.1 * compressible)
      << "half as far apart, an eighth of the volume";
}

}  // namespace assembly_exactness_test
}  // namespace palpate::assembly_fixture
