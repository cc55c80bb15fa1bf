// Random calls with good and bad arguments: no crash, finite results with status OK, untouched outputs on
// refusal. PALPATE_RANDOM_CALLS sets the number of calls.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>

#include "tests/support/nightly.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"

namespace palpate::test {
namespace random_calls_test {

constexpr unsigned char kCanary = 0xa5;
constexpr size_t kRecordingBytes = 1 << 16;

long num_calls() {
  return rounds_by("PALPATE_RANDOM_CALLS", kSanitized ? 8000 : 100000, 1000000);
}

// A struct in memory as long as any struct_size claims.
template <typename T>
struct Wide {
  T value = {};
  unsigned char more[5000] = {};
};

class RandomCalls : public ::testing::TestWithParam<pal_model> {
 protected:
  uint32_t any(uint32_t count) { return static_cast<uint32_t>(random_() % count); }
  bool rarely(uint32_t times = 40) { return any(times) == 0; }
  uint32_t index(uint32_t count) { return rarely(60) ? any(0xffffffff) : any(count); }
  template <typename T>
  T* rarely_null(T* pointer) {
    return rarely(60) ? nullptr : pointer;
  }
  double number() {
    constexpr double kOrdinary[] = {0, 1e-3, 0.01, 0.05, -0.05, 0.2, 1, -30};
    constexpr double kOdd[] = {5e-324,
                               1e-300,
                               -1e30,
                               1e300,
                               std::numeric_limits<double>::max(),
                               std::numeric_limits<double>::infinity(),
                               std::numeric_limits<double>::quiet_NaN()};
    if (rarely(60)) return kOdd[any(7)];
    return kOrdinary[any(8)] * std::uniform_real_distribution<double>(-1, 1)(random_);
  }
  pal_pose any_pose() {
    pal_pose any =
        pose({0.2 + 0.1 * small(), 0.2 + 0.1 * small(), 0.36 + 0.1 * small()}, {small(), small(), small()});
    if (rarely()) any.position[this->any(3)] = number();
    if (rarely()) any.orientation[this->any(4)] = number();
    return any;
  }
  double small() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  uint32_t size_of_struct(size_t bytes) { return rarely(80) ? any(5000) : static_cast<uint32_t>(bytes); }

  pal_status set_fixed() {
    uint32_t nodes[6];
    for (uint32_t& node : nodes) node = index(info_.num_contact_nodes);
    return pal_session_set_fixed(session_.get(), rarely_null(nodes), any(4) == 0 ? any(7) : 0);
  }
  pal_status hold() {
    Wide<pal_hold> wide = {pal_default_hold(index(info_.num_sites)), {}};
    pal_hold& hold = wide.value;
    hold.struct_size = size_of_struct(sizeof hold);
    if (any(3) == 0) {
      hold.sites[1] = index(info_.num_sites);
      hold.weights[1] = 0.25;
      hold.weights[0] = 0.75;
    }
    // A corner without weight may name any site.
    if (any(3) == 0) hold.sites[2] = any(0xffffffff);
    if (rarely()) hold.weights[2] = number();
    if (any(2) == 0) hold.law = PAL_LAW_TOUCH;
    if (any(2) == 0) hold.unstrained = any_pose();
    return pal_tool_hold(session_.get(), index(4), rarely_null(&hold));
  }
  pal_status touch() {
    Wide<pal_touch> wide;
    pal_touch& touch = wide.value;
    touch.struct_size = size_of_struct(sizeof touch);
    touch.law = any(2) == 0 ? PAL_LAW_TOUCH : PAL_LAW_BONDED;
    touch.tip[any(3)] = rarely(5) ? number() : 0;
    touch.distance = rarely(5) ? number() : 0.01;
    return pal_tool_set_touch(session_.get(), index(4), any(4) == 0 ? nullptr : &touch);
  }
  pal_status contact_frame() {
    pal_contact contacts[5];
    for (pal_contact& contact : contacts) {
      contact.site = index(info_.num_sites);
      for (double& component : contact.displacement) component = number();
      contact.force_axes = any(3) == 0 ? any(9) : 0;
      for (double& component : contact.force) component = number();
      const bool between = any(2) == 0;
      for (int i = 0; i < 2; ++i) {
        contact.neighbours[i] = index(info_.num_sites);
        contact.neighbour_weights[i] = rarely() ? number() : between ? 0.1 * any(6) : 0;
      }
      // A corner without weight, or with a weight lost to rounding, may name any site.
      if (any(4) == 0) {
        const double weight = 0.1 * any(11);
        contact.site = any(0xffffffff);
        contact.neighbour_weights[0] = weight;
        contact.neighbour_weights[1] = 1 - weight;
      } else if (any(4) == 0) {
        contact.neighbours[1] = any(0xffffffff);
        contact.neighbour_weights[1] = 0;
      }
    }
    pal_contact_result results[5];
    std::memset(static_cast<void*>(results), kCanary, sizeof results);
    const uint32_t count = any(3) == 0 ? any(6) : 1;
    const pal_status status =
        pal_contact_frame(session_.get(), rarely_null(contacts), count, rarely_null(results));
    const bool written = is_written(results);
    EXPECT_FALSE(written && status != PAL_STATUS_OK);
    for (uint32_t c = 0; written && c < count; ++c) EXPECT_TRUE(all_finite(results[c]));
    return status;
  }
  pal_status haptic_frame() {
    std::vector<pal_pose> poses(4);
    std::vector<double> ages(4);
    for (pal_pose& pose : poses) pose = any_pose();
    for (double& age : ages) age = rarely() ? number() : 0;
    Wide<pal_haptic_input> wide = {ToolSession::input(poses, rarely() ? number() : 0.001), {}};
    pal_haptic_input& input = wide.value;
    input.struct_size = size_of_struct(sizeof input);
    input.num_tools = rarely() ? any(0xffffffff) : any(5);
    input.ages = any(2) == 0 ? ages.data() : nullptr;
    input.poses = rarely_null(input.poses);
    input.result_bytes = size_of_struct(sizeof(pal_tool_result));
    input.num_results = any(6);
    // Room for four results of any size that the library accepts.
    std::vector<unsigned char> memory(4 * 5000, kCanary);
    auto* results = reinterpret_cast<pal_tool_result*>(memory.data());
    const pal_status status = pal_haptic_frame(session_.get(), rarely_null(&input), rarely_null(results));
    const bool written = is_written(memory.data());
    EXPECT_FALSE(written && status != PAL_STATUS_OK);
    for (uint32_t tool = 0; written && tool < std::min(4u, input.num_results); ++tool) {
      pal_tool_result result;
      std::memcpy(&result, memory.data() + tool * input.result_bytes, sizeof result);
      EXPECT_TRUE(force_of(result).allFinite() && torque_of(result).allFinite() &&
                  stiffness_of(result).allFinite() && std::isfinite(result.displacement_error) &&
                  std::isfinite(result.force_error));
    }
    return status;
  }
  pal_status visual_frame() {
    std::fill(field_.begin(), field_.end(), 0.0f);
    const size_t strides[] = {kNodeBytes, kNodeBytes + sizeof(pal_real), 2 * kNodeBytes, kNodeBytes,
                              kNodeBytes, kNodeBytes - sizeof(pal_real)};
    const pal_status status = pal_visual_frame(session_.get(), rarely_null(field_.data()), strides[any(6)]);
    EXPECT_TRUE(all_finite(field_));
    return status;
  }
  pal_status normals() {
    std::vector<pal_real> normals(field_.size());
    const size_t strides[] = {kNodeBytes, kNodeBytes + sizeof(pal_real), 2 * kNodeBytes, kNodeBytes,
                              kNodeBytes, kNodeBytes - sizeof(pal_real)};
    const pal_status status = pal_pack_compute_normals(pack_.get(), rarely_null(field_.data()),
                                                       strides[any(6)], normals.data(), strides[any(6)]);
    EXPECT_TRUE(all_finite(normals));
    return status;
  }
  pal_status query() {
    uint32_t found = 0;
    switch (any(3)) {
      case 0: {
        const pal_status status =
            pal_pack_find_site(pack_.get(), static_cast<int32_t>(any(80)), rarely_null(&found));
        EXPECT_LT(found, info_.num_sites);
        return status;
      }
      case 1: {
        const pal_status status =
            pal_pack_find_contact_node(pack_.get(), static_cast<int32_t>(any(80)), rarely_null(&found));
        EXPECT_LT(found, info_.num_contact_nodes);
        return status;
      }
      default: {
        const double place[3] = {number(), number(), number()};
        pal_surface_point point = {};
        const pal_status status = pal_pack_find_surface_point(pack_.get(), place, rarely_null(&point));
        for (int i = 0; i < 3; ++i) {
          EXPECT_TRUE(std::isfinite(point.position[i]) && std::isfinite(point.weights[i]) &&
                      std::isfinite(point.normal[i]));
          EXPECT_LT(point.sites[i], info_.num_sites);
        }
        EXPECT_TRUE(std::isfinite(point.distance));
        return status;
      }
    }
  }
  pal_status recording() {
    size_t bytes = 0;
    if (any(2) == 0) return pal_session_record(session_.get(), recording_.data(), kRecordingBytes);
    if (any(2) == 0) return pal_session_stop_recording(session_.get(), rarely_null(&bytes), nullptr);
    Wide<pal_replay> wide;
    pal_replay& replay = wide.value;
    replay.struct_size = size_of_struct(sizeof replay);
    replay.offset = 8 * static_cast<uint64_t>(any(kRecordingBytes / 8));
    return pal_session_replay(session_.get(), recording_.data(), kRecordingBytes, rarely_null(&replay));
  }
  pal_status include() {
    Wide<pal_inclusion> wide;
    pal_inclusion& inclusion = wide.value;
    inclusion.struct_size = size_of_struct(sizeof inclusion);
    for (double& component : inclusion.centre) component = rarely() ? number() : 0.2 + 0.2 * small();
    inclusion.radius = rarely() ? number() : 0.1 + 0.1 * small();
    inclusion.stiffness = rarely() ? number() : std::exp(4.6 * small());
    return pal_session_set_inclusion(session_.get(), rarely_null(&inclusion));
  }
  pal_status orient() {
    double orientations[20];
    for (uint32_t c = 0; c < 5; ++c) {
      const pal_pose any = any_pose();
      std::copy(any.orientation, any.orientation + 4, orientations + 4 * c);
    }
    return pal_session_set_orientations(session_.get(), rarely_null(orientations), any(5));
  }
  pal_status torque() {
    Wide<pal_contact_torque> wide;
    pal_contact_torque& torque = wide.value;
    torque.struct_size = size_of_struct(sizeof torque);
    const pal_status status = pal_session_get_torque(session_.get(), index(3), rarely_null(&torque));
    for (const double component : torque.torque) EXPECT_TRUE(std::isfinite(component));
    for (const auto& row : torque.by_rotation) {
      for (const double entry : row) EXPECT_TRUE(std::isfinite(entry));
    }
    return status;
  }
  pal_status refine() {
    Wide<pal_refinement> wide;
    wide.value.struct_size = size_of_struct(sizeof wide.value);
    const uint64_t operations = any(3) == 0 ? 0 : any(200000);
    const pal_status status = pal_session_refine(session_.get(), operations, rarely_null(&wide.value));
    EXPECT_TRUE(std::isfinite(wide.value.change));
    return status;
  }
  pal_status call() {
    switch (any(27)) {
      case 0:
        return set_fixed();
      case 1:
      case 2:
        return hold();
      case 3:
        return pal_tool_release(session_.get(), index(4));
      case 4:
        return touch();
      case 5:
        return visual_frame();
      case 6:
        return normals();
      case 7:
        return query();
      case 8:
        return rarely(10) ? recording() : PAL_STATUS_OK;
      case 9:
      case 10:
      case 11:
      case 12:
        return contact_frame();
      case 13:
        return include();
      case 14:
        return orient();
      case 15:
        return torque();
      case 16:
        return refine();
      default:
        return haptic_frame();
    }
  }

  static bool is_written(const void* memory) {
    unsigned char first[8];
    std::memcpy(first, memory, sizeof first);
    return first[0] != kCanary || first[7] != kCanary;
  }
  pal_session_config config() {
    pal_session_config config = session_config(pack_.get(), GetParam(), 3, 4);
    config.blend_seconds = 0.005;
    config.patches_turn = GetParam() == PAL_MODEL_ZONE ? 1 : 0;
    config.budget_operations = 3000;
    config.organ = pose({0.01, -0.02, 0.005}, {0.1, 0.05, -0.02});
    return config;
  }

  // Only the zone model gets a pack with zones; else zones would answer for linear_dd.
  OpenPack pack_{GetParam() == PAL_MODEL_ZONE ? zone_pack_bytes() : small_pack_bytes()};
  pal_pack_info info_ = pack_.info();
  OwnedSession session_{pack_.get(), config()};
  std::vector<pal_real> field_ = std::vector<pal_real>(size_t{6} * info_.num_nodes);
  std::vector<uint64_t> recording_ = std::vector<uint64_t>(kRecordingBytes / 8);
  std::mt19937_64 random_{23};
};

INSTANTIATE_TEST_SUITE_P(Models, RandomCalls,
                         ::testing::Values(PAL_MODEL_AUTO, PAL_MODEL_LINEAR, PAL_MODEL_POLYNOMIAL,
                                           PAL_MODEL_ZONE),
                         [](const auto& model) {
                           return model.param == PAL_MODEL_AUTO         ? "Auto"
                                  : model.param == PAL_MODEL_LINEAR     ? "Linear"
                                  : model.param == PAL_MODEL_POLYNOMIAL ? "Polynomial"
                                                                        : "Zone";
                         });

TEST_P(RandomCalls, NeverCrashOrAnswerNonsense) {
  const long calls = num_calls();
  require(pal_session_record(session_.get(), recording_.data(), kRecordingBytes), "record");
  long ok = 0;
  long refused = 0;
  for (long i = 0; i < calls; ++i) {
    ++(call() == PAL_STATUS_OK ? ok : refused);
    ASSERT_FALSE(HasFailure()) << "call " << i;
  }
  EXPECT_GT(ok, calls / 3);
  EXPECT_GT(refused, calls / 50);
}

}  // namespace random_calls_test
}  // namespace palpate::test
