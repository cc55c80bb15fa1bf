// Bullet's deformable body as a peer: its law with our moduli at small strain, forces in our units, and our
// statics after settling.
#include "bench/speed_error/bullet_body.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <functional>
#include <stdexcept>
#include <string>

#include "offline/precompute/contact_truth.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate::study {
namespace {

using test::BlockShape;

constexpr double kMu = 0.48;
constexpr double kLambda = 0.2;
constexpr double kSinglePrecision =
    2e-5;  // rounding of stresses, which are differences of terms as large as mu

// sum_a f_a X_a^T = int P dV over all nodes, whatever the mesh.
Eigen::Matrix3d virial(const Model& model, const Eigen::VectorXd& force) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int node = 0; node < model.num_nodes(); ++node)
    sum += force.segment<3>(3 * node) * model.positions[static_cast<size_t>(node)].transpose();
  return sum;
}

Eigen::Matrix3d virial_at(const Model& model, const Eigen::Matrix3d& deformation_gradient) {
  BulletBody body(model, std::vector<char>(static_cast<size_t>(model.num_dofs()), 1));
  body.frame(test::affine_displacement(model, deformation_gradient));
  EXPECT_NEAR(body.smallest_jacobian(), std::min(1.0, deformation_gradient.determinant()), kSinglePrecision);
  return virial(model, body.internal_force());
}

Model block(std::array<int, 3> cells = {3, 3, 3}) {
  BlockShape shape;
  shape.cells = cells;
  shape.law = CompressibleNeoHookean{kMu, kLambda};
  return test::tetrahedral_block(shape);
}

// Smith, De Goes and Kim 2018, with mu_b = 4/3 mu and lambda_b = lambda + 5/6 mu.
TEST(BulletBody, HasItsOwnLaw) {
  Eigen::Matrix3d f;
  f << 1.2, 0.1, -0.05, 0.2, 0.8, 0.15, 0, -0.1, 0.95;
  const double mu = 4 * kMu / 3;
  const double lambda = kLambda + 5 * kMu / 6;
  const double j = f.determinant();
  const Eigen::Matrix3d expected =
      mu * (1 - 1 / (f.squaredNorm() + 1)) * f + (lambda * (j - 1) - 0.75 * mu) * j * f.inverse().transpose();
  EXPECT_LT((virial_at(block(), f) - expected).norm(), kSinglePrecision * kMu);
}

TEST(BulletBody, HasOurModuliAtSmallStrain) {
  Eigen::Matrix3d h;
  h << 1, 0.5, -0.2, 0.3, -2, 0.4, 0.1, 0.6, 0.7;
  const double size = 1e-3;
  const Eigen::Matrix3d strain = size / 2 * (h + h.transpose());
  const Eigen::Matrix3d hooke = 2 * kMu * strain + kLambda * strain.trace() * Eigen::Matrix3d::Identity();
  constexpr double kSecondOrder = 1e-2;  // ten times the strain
  EXPECT_LT((virial_at(block(), Eigen::Matrix3d::Identity() + size * h) - hooke).norm(),
            kSecondOrder * hooke.norm());
}

// A stiffer half, like the brain's inclusion.
TEST(BulletBody, HoldsStifferMaterialsOfTheSameRatio) {
  Model model = block({2, 2, 2});
  model.materials.push_back({"STIFF", CompressibleNeoHookean{5 * kMu, 5 * kLambda}});
  Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
  f(0, 1) = 0.3;
  f(2, 2) = 0.9;
  const Eigen::Matrix3d soft = virial_at(model, f);
  double part = 0;
  for (size_t i = 0; i < model.elements.size(); i += 2) {
    model.elements[i].material = 1;
    Eigen::Matrix3d edges;
    for (int a = 0; a < 3; ++a) {
      edges.col(a) =
          model.positions[static_cast<size_t>(model.elements[i].node_array[static_cast<size_t>(a) + 1])] -
          model.positions[static_cast<size_t>(model.elements[i].node_array[0])];
    }
    part += edges.determinant() / 6;
  }
  EXPECT_LT((virial_at(model, f) - (1 + 4 * part) * soft).norm(), 5 * kSinglePrecision * kMu);
}

// A small push settles at the solution of linear elasticity.
TEST(BulletBody, SettlesInOurStatics) {
  test::TouchedBlock touched = test::touched_block(4, 0.3);
  test::show_every_node(touched);
  Model linear = touched.model;
  linear.materials.front().law = LinearElastic{kMu, kLambda};
  const Eigen::Vector3d d(1e-3, 5e-4, -2e-3);
  const Assembly assembly(linear, linear.fixed_dofs());
  const std::vector<LinearContact> contacts = {{0, d}};
  const ContactTruth truth = solve_contact_sets(assembly, touched.sites, {contacts}, 1, RestState()).front();
  ASSERT_TRUE(truth.solved);

  const LoadCase load = held_patches(touched.model, touched.sites, RestState(), contacts);
  BulletBody body(touched.model, load.held, 1);  // each frame halves the distance to equilibrium, roughly
  constexpr int kFrames = 30;
  for (int frame = 0; frame < kFrames; ++frame) body.frame(load.displacement);
  const Eigen::VectorXd u = body.displacement();
  const Eigen::VectorXd wrong = packed_rows(touched.sites, u) - truth.field;
  constexpr double kSecondOrder = 1e-2;  // over the push, a hundredth of an edge
  EXPECT_LT(wrong.reshaped(3, wrong.size() / 3).colwise().norm().maxCoeff(), kSecondOrder * d.norm());
  const Eigen::VectorXd force = body.internal_force();
  Eigen::Vector3d tool = Eigen::Vector3d::Zero();
  for (const int node : touched.sites.sites[0].patch_nodes) tool += force.segment<3>(3 * node);
  EXPECT_LT((tool - truth.forces[0]).norm(), kSecondOrder * truth.forces[0].norm());
  constexpr double kOfSettling = 1e-2;
  EXPECT_LT(body.imbalance(), kOfSettling);
}

TEST(BulletBody, DoesNotHideThatItHasNotSettled) {
  const test::TouchedBlock touched = test::touched_block(3, 0.3);
  const auto load_of = [&](double size) {
    return held_patches(touched.model, touched.sites, RestState(), {{0, {0, 0, -size}}});
  };
  const LoadCase load = load_of(0.05);
  BulletBody moving(touched.model, load.held);
  moving.frame(load.displacement);
  constexpr double kFarFromBalance = 0.1;
  EXPECT_GT(moving.imbalance(), kFarFromBalance);
  // Single precision ends below 1e39.
  const LoadCase beyond = load_of(1e25);
  BulletBody lost(touched.model, beyond.held);
  for (int frame = 0; frame < 3; ++frame) lost.frame(beyond.displacement);
  EXPECT_FALSE(lost.displacement().allFinite() && lost.imbalance() < kFarFromBalance);
}

TEST(BulletBody, RefusesWhatBulletDoesNotKnow) {
  const auto refusal = [](const Model& model, const std::vector<char>& held) -> std::string {
    try {
      const BulletBody body(model, held);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "none";
  };
  const Model model = block({1, 1, 1});
  std::vector<char> held = test::no_dofs(model);
  EXPECT_EQ(refusal(model, held), "none");
  held[4] = 1;
  EXPECT_EQ(refusal(model, held), "block: node 2 is held along some axes alone; Bullet holds whole nodes");
  const Model curved = test::with_middle_nodes(model);
  EXPECT_EQ(
      refusal(curved, test::no_dofs(curved)),
      "block: element 1 has ten nodes; Bullet knows tetrahedra of four nodes with volumes of their own");
  Model shared = model;
  shared.elements[1].volume_patch = 0;
  EXPECT_EQ(
      refusal(shared, test::no_dofs(shared)),
      "block: element 2 shares its volume change; Bullet knows tetrahedra of four nodes with volumes of "
      "their own");
  Model other = model;
  other.materials.push_back({"OTHER", CompressibleNeoHookean{kMu, 2 * kLambda}});
  other.elements[3].material = 1;
  EXPECT_EQ(refusal(other, test::no_dofs(other)),
            "block: material OTHER has another Poisson's ratio than TISSUE; a body of Bullet's has one");
}

}  // namespace
}  // namespace palpate::study
