// The loads of a step as nodal forces: their resultants, and their amplitudes in time.
#include "offline/fem/step_loads.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "offline/mesh/element_faces.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::test {
namespace step_loads_test {

struct Resultant {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  // about the origin
};

Resultant resultant_of(const Model& model, const Eigen::VectorXd& forces) {
  Resultant sum;
  for (int node = 0; node < model.num_nodes(); ++node) {
    sum.force += forces.segment<3>(3 * node);
    sum.torque += model.positions[static_cast<size_t>(node)].cross(forces.segment<3>(3 * node));
  }
  return sum;
}

class StepLoadsOfABlock : public ::testing::TestWithParam<bool> {
 protected:
  // 2 x 3 x 1 with density 1.5, and its faces at z = 1.
  StepLoadsOfABlock() {
    BlockShape shape;
    shape.cells = {2, 3, 2};
    shape.size = {2.0, 3.0, 1.0};
    model_ = tetrahedral_block(shape);
    if (GetParam()) model_ = with_middle_nodes(std::move(model_));
    model_.materials[0].density = 1.5;
    for (size_t e = 0; e < model_.elements.size(); ++e) {
      for (int face = 0; face < 4; ++face) {
        const std::array<int, 6> nodes = outward_face(model_.elements[e], face);
        const bool top = std::all_of(nodes.begin(), nodes.begin() + 3, [&](int node) {
          return model_.positions[static_cast<size_t>(node)].z() == 1.0;
        });
        if (top) top_.push_back({static_cast<int>(e), face});
      }
    }
  }

  Model model_;
  std::vector<FaceId> top_;
};

TEST_P(StepLoadsOfABlock, GravityPullsAtTheCentreOfMass) {
  const Eigen::Vector3d acceleration(0.3, -1.0, -9.81);
  Step step;
  for (size_t e = 0; e < model_.elements.size(); ++e)
    step.gravity.push_back({static_cast<int>(e), acceleration});
  const Resultant sum = resultant_of(model_, StepLoads(model_, step).at(1.0).force);
  const Eigen::Vector3d weight = 1.5 * 6.0 * acceleration;
  EXPECT_LE((sum.force - weight).norm(), 1e-12 * weight.norm());
  EXPECT_LE((sum.torque - Eigen::Vector3d(1.0, 1.5, 0.5).cross(weight)).norm(), 1e-12 * weight.norm());
}

TEST_P(StepLoadsOfABlock, TractionPullsAtTheCentreOfItsFaces) {
  const Eigen::Vector3d traction(0.5, 0.25, 1.0);
  Step step;
  for (const FaceId& face : top_) step.tractions.push_back({face, traction});
  const Resultant sum = resultant_of(model_, StepLoads(model_, step).at(1.0).force);
  EXPECT_LE((sum.force - 6.0 * traction).norm(), 1e-12);
  EXPECT_LE((sum.torque - Eigen::Vector3d(1.0, 1.5, 1.0).cross(6.0 * traction)).norm(), 1e-12);
}

TEST_P(StepLoadsOfABlock, PressureFollowsOnlyAtLargeDisplacements) {
  Step step;
  for (const FaceId& face : top_) step.pressures.push_back({face, 0.7});
  const LoadCase large = StepLoads(model_, step).at(1.0);
  EXPECT_EQ(large.pressures.size(), top_.size());
  EXPECT_EQ(large.force.norm(), 0.0);

  model_.materials[0].law = LinearElastic{1.0, 1.0};
  const LoadCase small = StepLoads(model_, step).at(1.0);
  EXPECT_TRUE(small.pressures.empty());
  const Resultant sum = resultant_of(model_, small.force);
  EXPECT_LE((sum.force - Eigen::Vector3d(0, 0, -4.2)).norm(), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Elements, StepLoadsOfABlock, ::testing::Bool(),
                         [](const auto& kind) { return kind.param ? "TenNodes" : "FourNodes"; });

TEST(StepLoads, AmplitudesCountFromTheStepOrFromTheBegin) {
  Model model = tetrahedral_block({});
  model.amplitudes = {{"STEP", false, {{0, 0}, {2, 4}}}, {"TOTAL", true, {{0, 0}, {10, 10}}}};
  Step step;
  step.start_time = 3;
  step.period = 2;
  step.forces = {{5, 0, 1.5, kRamp}, {5, 1, 1.0, 0}, {5, 2, 2.0, 1}, {5, 2, 1.0, 0}};
  step.prescribed = {{0, 2, 0.5, 1}};
  const StepLoads loads(model, step);
  const LoadCase half = loads.at(0.5);
  EXPECT_EQ(half.force.segment<3>(15), Eigen::Vector3d(1.5, 2.0, 2.0 * 4.0 + 2.0));
  EXPECT_EQ(half.displacement[2], 0.5 * 4.0);
  EXPECT_EQ(half.held[2], 1);
  EXPECT_EQ(half.held[3], 0);
  EXPECT_EQ(loads.at(1.0).force.segment<3>(15), Eigen::Vector3d(1.5, 4.0, 2.0 * 5.0 + 4.0));
}

}  // namespace step_loads_test
}  // namespace palpate::test
