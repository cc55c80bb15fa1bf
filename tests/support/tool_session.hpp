// A session driven by tool poses, and poses from Eigen types.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "tests/support/runtime_session.hpp"

namespace palpate::test {

inline Eigen::Matrix3d rotation_vector(const Eigen::Vector3d& turn) {
  if (turn.isZero(0)) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
}

inline pal_pose pose_of(const Eigen::Vector3d& position, const Eigen::Matrix3d& rotation) {
  const Eigen::Quaterniond q(rotation);
  return {{position[0], position[1], position[2]}, {q.w(), q.x(), q.y(), q.z()}};
}

inline pal_pose pose(const Eigen::Vector3d& position, const Eigen::Vector3d& turn) {
  return pose_of(position, rotation_vector(turn));
}

inline pal_pose at(const Eigen::Vector3d& position) {
  return {{position[0], position[1], position[2]}, {1, 0, 0, 0}};
}

inline pal_pose at_rest() {
  return at({0, 0, 0});
}

inline Eigen::Vector3d force_of(const pal_tool_result& result) {
  return Eigen::Vector3d(result.force);
}
inline Eigen::Vector3d torque_of(const pal_tool_result& result) {
  return Eigen::Vector3d(result.torque);
}
inline Eigen::Matrix3d stiffness_of(const pal_tool_result& result) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&result.stiffness[0][0]);
}

class ToolSession : public OwnedSession {
 public:
  ToolSession(const pal_pack* pack, const pal_session_config& config)
      : OwnedSession(pack, config), results_(config.max_tools) {}

  void hold(uint32_t tool, const pal_hold& hold) { require(pal_tool_hold(get(), tool, &hold), "hold"); }

  // Runs a tool frame of one millisecond. The refining lane prepares a zone for which the frame has asked before the next one.
  const std::vector<pal_tool_result>& frame(const std::vector<pal_pose>& poses) {
    return frame_with(poses, 0.001, {});
  }
  const std::vector<pal_tool_result>& frame_with(const std::vector<pal_pose>& poses, double dt,
                                                 const std::vector<double>& ages) {
    frame_once(poses, dt, ages);
    const auto is_preparing = [](const pal_tool_result& result) {
      return (result.flags & PAL_FLAG_PREPARING) != 0;
    };
    if (std::any_of(results_.begin(), results_.end(), is_preparing)) refine(*this);
    return results_;
  }
  // Without the refining lane.
  const std::vector<pal_tool_result>& frame_once(const std::vector<pal_pose>& poses, double dt = 0.001,
                                                 const std::vector<double>& ages = {}) {
    pal_haptic_input with = input(poses, dt);
    if (!ages.empty()) with.ages = ages.data();
    require(pal_haptic_frame(get(), &with, results_.data()), "haptic_frame");
    return results_;
  }
  static pal_haptic_input input(const std::vector<pal_pose>& poses, double dt) {
    pal_haptic_input input = {};
    input.struct_size = sizeof input;
    input.num_tools = static_cast<uint32_t>(poses.size());
    input.poses = poses.data();
    input.dt = dt;
    input.result_bytes = sizeof(pal_tool_result);
    input.num_results = 16;  // at most the session's capacity
    return input;
  }
  const std::vector<pal_tool_result>& last() const { return results_; }

 private:
  std::vector<pal_tool_result> results_;
};

}  // namespace palpate::test
