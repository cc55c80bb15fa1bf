// The discrete equations: forces are the gradient of the energy, the tangent that of the forces, and rigid
// motions cost nothing.
#include "offline/fem/assembly.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "offline/mesh/volume_patches.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace {

using test::affine_displacement;
using test::BlockShape;
using test::no_dofs;
using test::rotation_about;
using test::TestRandom;
using test::tetrahedral_block;

// Sums of a few dozen products: rounding, with room.
constexpr double kRounding = 1e-13;
// Central differences with steps of 1e-5 of the block: truncation 1e-10, rounding eps / 1e-5 = 2e-11, times
// what the energy's higher derivatives add.
constexpr double kStep = 1e-5;
constexpr double kDifference = 1e-7;

// Sharing: volume patches of four-node elements; one of each ten-node element (C3D10H).
enum class Kind { four_nodes, ten_nodes, four_nodes_sharing, ten_nodes_sharing };
constexpr std::array kKinds = {Kind::four_nodes, Kind::ten_nodes, Kind::four_nodes_sharing,
                               Kind::ten_nodes_sharing};

bool has_ten_nodes(Kind kind) {
  return kind == Kind::ten_nodes || kind == Kind::ten_nodes_sharing;
}

bool shares_volume(Kind kind) {
  return kind == Kind::four_nodes_sharing || kind == Kind::ten_nodes_sharing;
}

// `model` of four nodes as one of the kind; ten-node elements have curved edges where `jitter` is above 0.
Model in_kind(Kind kind, Model model, double jitter = 0.0) {
  if (has_ten_nodes(kind)) model = test::with_middle_nodes(std::move(model), jitter);
  if (!shares_volume(kind)) return model;
  std::vector<int> groups;
  for (const Tetrahedron& element : model.elements) groups.push_back(element.material);
  form_volume_patches(model, groups);
  return model;
}

Model several_materials(Kind kind = Kind::four_nodes) {
  BlockShape shape;
  shape.cells = {2, 2, 2};
  shape.size = {1.0, 1.25, 0.75};
  Model model = tetrahedral_block(shape);
  model.materials.push_back({"STIFF", CompressibleNeoHookean{2.4, 10.0}});
  // One for each way in which a tangent is assembled: H alone, F and H (YEOH), and all 81 numbers.
  model.materials.push_back({"YEOH", InvariantLaw{0.5, 0.0, 0.2, 0.05, {{0.8}}}});
  model.materials.push_back({"MOONEY-RIVLIN", InvariantLaw{0.4, 0.2, 0.0, 0.0, {{0.9}}}});
  // Those that share volumes have a cell of six, or two, in a row: patches do not cross materials.
  const size_t in_a_row = shares_volume(kind) ? 12 : 1;
  if (shares_volume(kind)) model.materials[2].law = Ogden{{{0.7, 1.5}, {0.2, -2.5}}, {{0.8, 0.3, 0.1}}};
  for (size_t e = 0; e < model.elements.size(); ++e)
    model.elements[e].material = static_cast<int>(e / in_a_row % 4);
  return in_kind(kind, std::move(model), 0.02);
}

// What must hold for elements of either kind; those of ten nodes have curved edges.
class AssemblyOfEachKind : public ::testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Assembly, AssemblyOfEachKind, ::testing::ValuesIn(kKinds), [](const auto& one) {
  return std::string(has_ten_nodes(one.param) ? "TenNodes" : "FourNodes") +
         (shares_volume(one.param) ? "SharingVolume" : "");
});

// A state far from rest: large shear, stretch and rotation, and every node moved at random on top.
Eigen::VectorXd distorted(const Model& model) {
  Eigen::Matrix3d F;
  F << 1.2, 0.4, -0.1, 0.05, 0.8, 0.2, 0.1, -0.15, 0.9;
  // Ten nodes lie half as far apart.
  const double noise = model.elements.front().num_nodes == 4 ? 0.05 : 0.01;
  return affine_displacement(model, rotation_about({1, 2, 3}, 1.1) * F) +
         noise * TestRandom(5).vector(model.num_dofs());
}

Eigen::MatrixXd dense_of(const Assembly::SparseLower& lower) {
  const Eigen::MatrixXd half(lower);
  return half.selfadjointView<Eigen::Lower>();
}

double stored_energy(const Assembly& assembly, const Eigen::VectorXd& displacement) {
  Eigen::VectorXd force;
  double energy = 0;
  assembly.internal_force(displacement, force, &energy);
  return energy;
}

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
  // A second state in the same matrix leaves nothing of the first.
  assembly.tangent(Eigen::VectorXd::Zero(model.num_dofs()), false, later);
  EXPECT_EQ((dense_of(later) - dense_of(rest)).norm(), 0.0);
}

TEST_P(AssemblyOfEachKind, ProjectedTangentHasNoNegativeEigenvalue) {
  const Model model = several_materials(GetParam());
  const Assembly assembly(model, no_dofs(model));
  // Squeezed to 0.6: pressure makes rotations, and with them the true tangent, unstable.
  const Eigen::VectorXd squeezed = affine_displacement(model, 0.6 * Eigen::Matrix3d::Identity()) +
                                   0.01 * TestRandom(6).vector(model.num_dofs());
  Assembly::SparseLower lower;
  assembly.tangent(squeezed, false, lower);
  const Eigen::MatrixXd exact = dense_of(lower);
  assembly.tangent(squeezed, true, lower);
  const Eigen::MatrixXd projected = dense_of(lower);
  const auto lowest = [](const Eigen::MatrixXd& matrix) {
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues()(0);
  };
  const double scale = projected.cwiseAbs().maxCoeff();
  ASSERT_LT(lowest(exact), -1e-3 * scale) << "else this test shows nothing";
  EXPECT_GE(lowest(projected), -kRounding * scale);
  EXPECT_GE(lowest(projected - exact), -kRounding * scale) << "projection only takes negative parts away";
}

TEST_P(AssemblyOfEachKind, ProjectionLeavesAPositiveTangentAlone) {
  const Model model = several_materials(GetParam());
  const Assembly assembly(model, no_dofs(model));
  // Stretched a little, so that tension steadies rotations; much more, and a law with a large lambda softens
  // in shear.
  const Eigen::VectorXd stretched = affine_displacement(model, 1.03 * rotation_about({1, -1, 2}, 0.7)) +
                                    0.002 * TestRandom(7).vector(model.num_dofs());
  Assembly::SparseLower exact;
  Assembly::SparseLower projected;
  assembly.tangent(stretched, false, exact);
  assembly.tangent(stretched, true, projected);
  // Without what keeps the volume, a point has modes that cost nothing: rounding makes some of them negative.
  const double allowed = shares_volume(GetParam()) ? kRounding * exact.norm() : 0.0;
  EXPECT_LE((dense_of(exact) - dense_of(projected)).norm(), allowed);
}

// Enough elements that every number of threads is really used.
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

TEST(AssemblyProperty, ProjectionOfOneElementLeavesTheOthers) {
  BlockShape shape;
  shape.cells = {3, 3, 3};
  const Model model = tetrahedral_block(shape);
  const Assembly assembly(model, no_dofs(model));
  // Everything stretched a little, and one corner node pushed into its elements.
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
    // Displacements of five block sizes are rounded at 1e-15.
    EXPECT_LE(force.cwiseAbs().maxCoeff(), 1e-13 * stiffest) << "angle " << angle;
    EXPECT_NEAR(state.min_jacobian, 1.0, 1e-13);
    EXPECT_NEAR(stored_energy(assembly, displacement), 0.0, 1e-13 * stiffest);
    // The tangent turns with the body: K (Q v) = Q K v for every v; here a random one.
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

TEST_P(AssemblyOfEachKind, ForcesBalanceInEveryState) {
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

// The patch test: under F everywhere the stress is the law's everywhere, and no inner node feels a force.
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

// A quadratic displacement is in the space of ten nodes: at rest their stiffness gives the exact energy of
// small strain; for u = (a z^2, 0, 0) on the unit cube, e_xz = a z, it is the integral of 2 mu e_xz^2, 2/3 mu
// a^2.
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
  // A shift that no coordinate is rounded by changes no bit.
  EXPECT_EQ((force_at({8192, -16384, 4096}) - near_force).norm(), 0.0);
  // Coordinates of 1e4 are rounded at 1e-12 and edges are about 0.5.
  EXPECT_LE((force_at({1.1e4, 0.7e4, -1.3e4}) - near_force).norm(), 1e-10 * near_force.norm());
}

// A state whose exact force is zero shows what rounding leaves: no more than is said, and no thousand times
// less.
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
  // Forces are known at eliminated dofs too: they are the reactions.
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
  // Moved straight down it keeps its distance from the plane x = y of 0 4 7 and crosses the plane y = z of 0
  // 1 7.
  Eigen::VectorXd displacement = Eigen::VectorXd::Zero(model.num_dofs());
  displacement.segment<3>(15) = Eigen::Vector3d(0, 0, -1.5);  // z = -0.5 < y = 0
  Eigen::VectorXd force;
  const ElementState state = assembly.internal_force(displacement, force);
  EXPECT_EQ(state.worst_element, 5);
  EXPECT_NEAR(state.min_jacobian, -0.5, 1e-14) << "the height over that face went from 1 to -1/2";
  EXPECT_EQ(stored_energy(assembly, displacement), std::numeric_limits<double>::infinity());
  // Flat counts as inverted, and so does what is not a number.
  displacement[17] = -1.0;
  EXPECT_EQ(stored_energy(assembly, displacement), std::numeric_limits<double>::infinity());
  EXPECT_LE(assembly.internal_force(displacement, force).min_jacobian, 0.0);
  displacement[17] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(stored_energy(assembly, displacement), std::numeric_limits<double>::infinity());
  EXPECT_FALSE(assembly.internal_force(displacement, force).min_jacobian > 0);
}

// Energy, force and tangent of laws whose measure of volume is not det F.
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

// The energy that shared_volumes.hpp states, formed element by element; and that of elements each in a patch of its
// own is that of C3D4.
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
  std::map<int, std::pair<double, double>> patches;  // volumes at rest and now
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

// Without a bulk modulus of their own, elements of a patch have no mode that costs less than those of a tissue without
// any resistance to a change of volume but that of its shear.
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
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(dense_of(lower), Eigen::EigenvaluesOnly);
    return modes.eigenvalues()[0];
  };
  const double compressible = softest(Kind::four_nodes, 2.0 / 3.0);  // mu = 1, lambda = 0
  EXPECT_GE(softest(Kind::four_nodes_sharing, 2.0 / 3.0), 0.9 * compressible);
  EXPECT_GE(softest(Kind::four_nodes_sharing, 5e3), compressible);
  EXPECT_GE(softest(Kind::ten_nodes_sharing, 5e3), 0.1 * compressible)
      << "half as far apart, an eighth of the volume";
}

}  // namespace
}  // namespace palpate
