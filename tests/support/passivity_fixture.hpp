// Counts the work of tools on the tissue.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test::passivity_fixture {

// Largest energy that a cycle may create, over the largest energy stored in the cycle.
inline constexpr double kAllowed = 0.003;

// Work of the tools on the tissue, by the trapezoidal rule over poses and forces that a device would see.
// Negative work means that the tissue gave a tool energy.
class Work {
 public:
  explicit Work(ToolSession& tools) : tools_(&tools) {}

  void frame(const std::vector<pal_pose>& poses) {
    const std::vector<pal_tool_result>& results = tools_->frame(poses);
    for (size_t tool = 0; tool < poses.size(); ++tool) {
      const Eigen::Vector3d force = force_of(results[tool]);
      const Eigen::Vector3d torque = torque_of(results[tool]);
      if (!before_.empty()) {
        const Eigen::Quaterniond turned = rotation(poses[tool]) * rotation(before_[tool]).conjugate();
        work_ += 0.5 * (force + forces_[tool]).dot(place(poses[tool]) - place(before_[tool]));
        work_ += 0.5 * (torque + torques_[tool]).dot((turned.w() < 0 ? -2.0 : 2.0) * turned.vec());
      }
      forces_[tool] = force;
      torques_[tool] = torque;
      reduced_ += (results[tool].flags & PAL_FLAG_REDUCED) != 0 ? 1 : 0;
    }
    peak_ = std::max(peak_, work_);
    before_ = poses;
  }

  double done() const { return work_; }
  double peak() const { return peak_; }
  int reduced() const { return reduced_; }  // number of results with a reduced force
  Eigen::Vector3d force(size_t tool) const { return forces_[tool]; }

  // Starts a new cycle.
  void restart() { work_ = peak_ = 0; }

 private:
  static Eigen::Vector3d place(const pal_pose& pose) { return Eigen::Vector3d(pose.position); }
  static Eigen::Quaterniond rotation(const pal_pose& pose) {
    return {pose.orientation[0], pose.orientation[1], pose.orientation[2], pose.orientation[3]};
  }

  ToolSession* tools_;
  std::vector<pal_pose> before_;
  std::array<Eigen::Vector3d, 4> forces_ = zeros();
  std::array<Eigen::Vector3d, 4> torques_ = zeros();
  double work_ = 0;
  double peak_ = 0;
  int reduced_ = 0;

  static std::array<Eigen::Vector3d, 4> zeros() {
    std::array<Eigen::Vector3d, 4> all;
    all.fill(Eigen::Vector3d::Zero());
    return all;
  }
};

}  // namespace palpate::test::passivity_fixture
