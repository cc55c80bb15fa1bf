// Tools that hold points between sites, on nonlinear zones.
#include <gtest/gtest.h>

#include "tests/support/zone_place_fixture.hpp"

namespace palpate::test::zone_place_fixture {
namespace zone_place_tools_test {

// Tools that hold two points between sites. The transferred bases of their zone are prepared in slices.
class ZonePlacesOfTools : public ZonePlaces {
 protected:
  pal_session_config config_with(uint64_t operations) const {
    pal_session_config config = session_config(pack_.get(), PAL_MODEL_ZONE, 3, 0);
    config.budget_operations = operations;
    return config;
  }
  pal_hold hold_at(const Eigen::Vector3d& position) const {
    const pal_surface_point point = point_at(position);
    pal_hold hold = pal_default_hold(point.sites[0]);
    for (int i = 0; i < 3; ++i) {
      hold.sites[i] = point.sites[i];
      hold.weights[i] = point.weights[i];
    }
    return hold;
  }
  static bool is_preparing(const pal_tool_result& result) { return (result.flags & PAL_FLAG_PREPARING) != 0; }

  const Eigen::Vector3d places_[3] = {{0.09, 0.14, 0.375}, {0.2, 0.16, 0.375}, {0.15, 0.28, 0.375}};
  const std::vector<pal_pose> poses_ = {at({0.005, 0, -0.02}), at({0, 0.004, -0.015}), at({0, 0, -0.01})};
};

INSTANTIATE_TEST_SUITE_P(MovedBy, ZonePlacesOfTools, testing::Bool(),
                         [](const auto& is) { return is.param ? "Polynomials" : "Linear"; });

TEST_P(ZonePlacesOfTools, ArePreparedWithinABudget) {
  ToolSession tools(pack_.get(), config_with(20000));
  ToolSession at_once(pack_.get(), config_with(0));
  for (uint32_t tool = 0; tool < 2; ++tool) {
    for (ToolSession* session : {&tools, &at_once}) session->hold(tool, hold_at(places_[tool]));
  }
  int frames = 0;
  while (is_preparing(tools.frame(poses_)[0])) {
    EXPECT_EQ(tools.last()[0].model, PAL_MODEL_LINEAR) << "until all of it is ready";
    EXPECT_GT(force_of(tools.last()[0]).norm(), 0);
    ASSERT_LT(++frames, 10000);
  }
  EXPECT_GE(frames, 1);
  for (int frame = 0; frame < 60; ++frame) {
    tools.frame(poses_);
    at_once.frame(poses_);
  }
  for (size_t tool = 0; tool < 2; ++tool) {
    EXPECT_EQ(tools.last()[tool].flags & PAL_FLAG_NEAREST_SITE, 0U);
    EXPECT_LE((force_of(tools.last()[tool]) - force_of(at_once.last()[tool])).norm(),
              1e-5 * force_of(at_once.last()[tool]).norm());
  }
}

// A third tool grasps and releases all the time; the preparation still ends.
TEST_P(ZonePlacesOfTools, AreAnsweredWhileContactsChange) {
  ToolSession tools(pack_.get(), config_with(20000));
  for (uint32_t tool = 0; tool < 2; ++tool) tools.hold(tool, hold_at(places_[tool]));
  int answered = 0;
  for (int frame = 0; frame < 3000; ++frame) {
    if (frame % 6 == 3) tools.hold(2, hold_at(places_[2]));
    if (frame % 6 == 0) require(pal_tool_release(tools.get(), 2), "release");
    answered += force_of(tools.frame(poses_)[1]).norm() > 0;
    for (const pal_tool_result& result : tools.last()) EXPECT_TRUE(force_of(result).allFinite());
  }
  EXPECT_GT(answered, 1000);
}

// A tool's stiffness over its two points, with their interaction.
TEST_P(ZonePlacesOfTools, SumToTheStiffnessOfTheTool) {
  ToolSession tools(pack_.get(), config_with(0));
  for (int i = 0; i < 2; ++i) tools.hold(0, hold_at(places_[i]));
  const auto settled_at = [&](const Eigen::Vector3d& p) {
    for (int frame = 0; frame < 2 * PAL_ZONE_STIFFNESS_FRAMES; ++frame) tools.frame({at(p)});
    return tools.last()[0];
  };
  const Eigen::Vector3d place(0.004, -0.006, -0.02);
  const Eigen::Matrix3d stiffness = stiffness_of(settled_at(place));
  constexpr double kStep = 1e-4;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
    const Eigen::Vector3d ahead = force_of(settled_at(place + step));
    const Eigen::Vector3d behind = force_of(settled_at(place - step));
    EXPECT_LE(((ahead - behind) / (2 * kStep) - stiffness.col(axis)).norm(), 3e-3 * stiffness.norm());
  }
}

}  // namespace zone_place_tools_test
}  // namespace palpate::test::zone_place_fixture
