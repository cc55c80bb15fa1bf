// Tools grasp the surface when they enter the tissue, and release it outside.
#include <gtest/gtest.h>

#include "tests/support/tools_fixture.hpp"

namespace palpate::test::tools_fixture {
namespace touch_test {

// ---- Touch

class Touch : public Tools {
 protected:
  static pal_touch touch(pal_contact_law law, double distance = 0) {
    pal_touch touch = {};
    touch.struct_size = sizeof touch;
    touch.law = law;
    touch.distance = distance;
    return touch;
  }
  void set(ToolSession& tools, uint32_t tool, const pal_touch& touch) {
    require(pal_tool_set_touch(tools.get(), tool, &touch), "touch");
  }
  // A little beside the site, so that the site is the nearest corner and the point lies in a triangle.
  pal_pose above(double height) const {
    return at(site_position(pack_, site_) + Eigen::Vector3d(0.011, 0.017, height));
  }
  const uint32_t site_ = small_pack().site_at(55);
};

TEST_F(Touch, HoldsWhatItMeetsAndLetsGoOutside) {
  set(tools_, 1, touch(PAL_LAW_TOUCH));
  const auto frame = [&](double height) { return tools_.frame({at({0, 0, 9}), above(height)})[1]; };
  for (const double height : {0.1, 0.01, 1e-9}) EXPECT_EQ(frame(height).num_contacts, 0U) << height;
  const pal_tool_result met = frame(-0.001);
  EXPECT_EQ(met.num_contacts, 1U);
  EXPECT_EQ(met.site, site_);
  EXPECT_LE(force_of(met).norm(), kRounding) << "unstrained where it was met";
  pal_surface_point place;
  require(pal_pack_find_surface_point(pack_.get(), above(0).position, &place), "surface point");
  const Eigen::Vector3d d(0, 0, -0.03);
  const pal_contact_result expected = contacts_.touch({pal_contact_at(&place, d.data())})[0];
  expect_near(force_of(frame(-0.031)), Eigen::Vector3d(expected.force), 1e-9, "pressed");
  EXPECT_EQ(frame(-0.0011).num_contacts, 1U);
  EXPECT_EQ(frame(0.0002).num_contacts, 1U) << "within the tremor of a hand";
  EXPECT_EQ(frame(0.002).num_contacts, 0U);
  EXPECT_EQ(force_of(tools_.last()[1]).norm(), 0);
}

// A fast tool is deep at once: it grasps there, holds until it is out again, and grasps no second time
// before.
TEST_F(Touch, AFastToolLetsGoOnce) {
  set(tools_, 0, touch(PAL_LAW_TOUCH));
  tools_.frame({above(0.1)});
  int changes = 0;
  uint32_t before = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const uint32_t now = tools_.frame({above(-0.04 + 0.001 * frame)})[0].num_contacts;
    changes += now != before;
    before = now;
  }
  EXPECT_EQ(changes, 2);
  EXPECT_EQ(before, 0U);
  EXPECT_EQ(tools_.frame({above(-0.01)})[0].num_contacts, 1U) << "it was outside";
  require(pal_tool_release(tools_.get(), 0), "release");
  EXPECT_EQ(tools_.frame({above(-0.01)})[0].num_contacts, 0U) << "released means released";
}

TEST_F(Touch, LetsGoWhereverItComesOut) {
  set(tools_, 0, touch(PAL_LAW_TOUCH));
  tools_.frame({above(0.01)});
  ASSERT_EQ(tools_.frame({above(-0.001)})[0].num_contacts, 1U);
  // Through the block and out of its side, far below the entry.
  const Eigen::Vector3d inside(above(-0.1).position);
  ASSERT_EQ(tools_.frame({at(inside)})[0].num_contacts, 1U);
  EXPECT_EQ(tools_.frame({at(inside + Eigen::Vector3d(5, 0, 0))})[0].num_contacts, 0U);
  EXPECT_EQ(tools_.frame({above(-0.2)})[0].num_contacts, 0U) << "too deep to have just come in";
}

TEST_F(Touch, BondedItStays) {
  set(tools_, 0, touch(PAL_LAW_BONDED));
  tools_.frame({above(-0.001)});
  const pal_tool_result pulled = tools_.frame({above(0.02)})[0];
  EXPECT_EQ(pulled.num_contacts, 1U);
  EXPECT_GT(pulled.force[2], 0) << "pulling takes an outward force";
  require(pal_tool_release(tools_.get(), 0), "release");
  EXPECT_EQ(tools_.frame({above(0.02)})[0].num_contacts, 0U);
}

TEST_F(Touch, CountsFromTheTipAndItsRadius) {
  pal_touch with_tip = touch(PAL_LAW_TOUCH, 0.02);
  with_tip.tip[0] = 0.3;  // the tool lies on its side
  set(tools_, 0, with_tip);
  const Eigen::Vector3d down(0, M_PI / 2, 0);  // rotates x to -z
  const auto frame = [&](double tip_height) {
    const Eigen::Vector3d tip = Eigen::Vector3d(above(tip_height).position);
    return tools_.frame({pose(tip + Eigen::Vector3d(0, 0, 0.3), down)})[0];
  };
  EXPECT_EQ(frame(0.021).num_contacts, 0U);
  EXPECT_EQ(frame(0.019).num_contacts, 1U);
}

TEST_F(Touch, SaysWhenThereIsNoRoom) {
  ToolSession tools(pack_.get(), session_config(pack_.get(), PAL_MODEL_AUTO, 1, 0));
  set(tools, 0, touch(PAL_LAW_TOUCH));
  set(tools, 1, touch(PAL_LAW_TOUCH));
  const auto results = tools.frame({above(-0.001), above(-0.002)});
  EXPECT_EQ(results[0].num_contacts, 1U);
  EXPECT_EQ(results[1].num_contacts, 0U);
  EXPECT_TRUE(results[1].flags & PAL_FLAG_NO_ROOM);
  EXPECT_FALSE(results[0].flags & PAL_FLAG_NO_ROOM);
}

TEST_F(Touch, RefusesSenselessArguments) {
  pal_touch bad = touch(PAL_LAW_TOUCH);
  bad.tip[1] = std::nan("");
  EXPECT_EQ(pal_tool_set_touch(tools_.get(), 0, &bad), PAL_STATUS_NOT_FINITE);
  bad = touch(PAL_LAW_TOUCH, HUGE_VAL);
  EXPECT_EQ(pal_tool_set_touch(tools_.get(), 0, &bad), PAL_STATUS_NOT_FINITE);
  bad = touch(PAL_LAW_TOUCH, -0.001);
  EXPECT_EQ(pal_tool_set_touch(tools_.get(), 0, &bad), PAL_STATUS_BAD_ARGUMENT);
  bad = touch(PAL_LAW_TOUCH);
  bad.struct_size = 4;
  EXPECT_EQ(pal_tool_set_touch(tools_.get(), 0, &bad), PAL_STATUS_BAD_STRUCT_SIZE);
  EXPECT_EQ(pal_tool_set_touch(nullptr, 0, nullptr), PAL_STATUS_NULL_ARGUMENT);
  EXPECT_EQ(tools_.frame({above(-0.01)})[0].num_contacts, 0U);
}

TEST_F(Touch, FindsSurfacePointsInTheOrgansFrame) {
  const Eigen::Vector3d x(above(0.04).position);
  pal_surface_point point;
  ASSERT_EQ(pal_pack_find_surface_point(pack_.get(), x.data(), &point), PAL_STATUS_OK);
  EXPECT_NEAR(point.distance, 0.04, kRounding);
  EXPECT_NEAR(point.normal[2], 1, 1e-6);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i) sum += point.weights[i] * site_position(pack_, point.sites[i]);
  expect_near(sum, Eigen::Vector3d(point.position), kRounding, "the weighted corners");
  const Eigen::Vector3d nowhere(0, std::nan(""), 0);
  EXPECT_EQ(pal_pack_find_surface_point(pack_.get(), nowhere.data(), &point), PAL_STATUS_NOT_FINITE);
  const Eigen::Vector3d far(0, 1e90, 0);
  EXPECT_EQ(pal_pack_find_surface_point(pack_.get(), far.data(), &point), PAL_STATUS_BAD_ARGUMENT);
}

}  // namespace touch_test
}  // namespace palpate::test::tools_fixture
