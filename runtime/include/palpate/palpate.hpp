// The C API as classes: Pack closes its pack at the end of its scope, arrays are spans, and struct sizes are
// set. The classes add no behaviour, exceptions or allocation.
#pragma once

#include <palpate/palpate.h>

#include <span>

namespace palpate {

namespace detail {
// A struct of zeros with its struct_size.
template <typename T>
[[nodiscard]] T sized() noexcept {
  T value = {};
  value.struct_size = sizeof value;
  return value;
}

template <typename T>
[[nodiscard]] uint32_t count_of(std::span<T> values) noexcept {
  return static_cast<uint32_t>(values.size());
}
}  // namespace detail

class Pack {
 public:
  Pack() = default;
  ~Pack() { pal_pack_close(pack_); }
  Pack(const Pack&) = delete;
  Pack& operator=(const Pack&) = delete;

  [[nodiscard]] pal_status open(const char* path, pal_verify verify = PAL_VERIFY_ONCE) noexcept {
    close();
    return pal_pack_open(path, verify, storage_, sizeof storage_, &pack_);
  }
  [[nodiscard]] pal_status open_memory(const void* bytes, size_t num_bytes,
                                       pal_verify verify = PAL_VERIFY_ONCE) noexcept {
    close();
    return pal_pack_open_memory(bytes, num_bytes, verify, storage_, sizeof storage_, &pack_);
  }
  void close() noexcept {
    pal_pack_close(pack_);
    pack_ = nullptr;
  }
  // info() and geometry() return zeros if no pack is open.
  [[nodiscard]] pal_pack_info info() const noexcept {
    auto info = detail::sized<pal_pack_info>();
    if (pal_pack_get_info(pack_, &info) != PAL_STATUS_OK) return {};
    return info;
  }
  [[nodiscard]] pal_geometry geometry() const noexcept {
    auto geometry = detail::sized<pal_geometry>();
    if (pal_pack_get_geometry(pack_, &geometry) != PAL_STATUS_OK) return {};
    return geometry;
  }
  [[nodiscard]] pal_status find_site(int32_t node_label, uint32_t& site) const noexcept {
    return pal_pack_find_site(pack_, node_label, &site);
  }
  [[nodiscard]] pal_status find_contact_node(int32_t node_label, uint32_t& contact_node) const noexcept {
    return pal_pack_find_contact_node(pack_, node_label, &contact_node);
  }
  [[nodiscard]] pal_status get_site_node(uint32_t site, uint32_t& node) const noexcept {
    return pal_pack_get_site_node(pack_, site, &node);
  }
  [[nodiscard]] pal_status get_bytes(const void*& bytes, size_t& num_bytes) const noexcept {
    return pal_pack_get_bytes(pack_, &bytes, &num_bytes);
  }
  [[nodiscard]] pal_status find_surface_point(const double position[3],
                                              pal_surface_point& point) const noexcept {
    return pal_pack_find_surface_point(pack_, position, &point);
  }
  // All packed nodes; by default rows without gaps.
  [[nodiscard]] pal_status compute_normals(const pal_real* displacements, pal_real* normals,
                                           size_t displacement_stride = 3 * sizeof(pal_real),
                                           size_t normal_stride = 3 * sizeof(pal_real)) const noexcept {
    return pal_pack_compute_normals(pack_, displacements, displacement_stride, normals, normal_stride);
  }
  [[nodiscard]] const pal_pack* get() const noexcept { return pack_; }

 private:
  alignas(16) unsigned char storage_[PAL_PACK_STORAGE_BYTES] = {};
  pal_pack* pack_ = nullptr;
};

class Session {
 public:
  [[nodiscard]] static pal_session_config default_config(const Pack& pack) noexcept {
    return pal_default_session_config(pack.get());
  }
  [[nodiscard]] static pal_status required_bytes(const Pack& pack, const pal_session_config& config,
                                                 size_t& bytes) noexcept {
    return pal_session_required_bytes(pack.get(), &config, &bytes);
  }
  [[nodiscard]] pal_status init(const Pack& pack, const pal_session_config& config,
                                std::span<unsigned char> arena) noexcept {
    return pal_session_init(pack.get(), &config, arena.data(), arena.size(), &session_);
  }
  // config() and counters() return zeros if no session has started.
  [[nodiscard]] pal_session_config config() const noexcept {
    auto config = detail::sized<pal_session_config>();
    if (pal_session_get_config(session_, &config) != PAL_STATUS_OK) return {};
    return config;
  }
  [[nodiscard]] pal_counters counters() const noexcept {
    auto counters = detail::sized<pal_counters>();
    if (pal_session_get_counters(session_, &counters) != PAL_STATUS_OK) return {};
    return counters;
  }
  [[nodiscard]] pal_status set_fixed(std::span<const uint32_t> contact_nodes) noexcept {
    return pal_session_set_fixed(session_, contact_nodes.data(), detail::count_of(contact_nodes));
  }
  // `acceleration`: [3]; nullptr: the scene's gravity.
  [[nodiscard]] pal_status set_gravity(const double* acceleration) noexcept {
    return pal_session_set_gravity(session_, acceleration);
  }
  // `inclusion`: nullptr removes the inclusion.
  [[nodiscard]] pal_status set_inclusion(const pal_inclusion* inclusion) noexcept {
    return pal_session_set_inclusion(session_, inclusion);
  }

  // `results` must be as long as `contacts`.
  [[nodiscard]] pal_status contact_frame(std::span<const pal_contact> contacts,
                                         std::span<pal_contact_result> results) noexcept {
    if (results.size() != contacts.size()) return PAL_STATUS_BAD_ARGUMENT;
    return pal_contact_frame(session_, contacts.data(), detail::count_of(contacts), results.data());
  }
  // `orientations`: [count][4].
  [[nodiscard]] pal_status set_orientations(const double* orientations, uint32_t count) noexcept {
    return pal_session_set_orientations(session_, orientations, count);
  }
  [[nodiscard]] pal_status get_torque(uint32_t contact, pal_contact_torque& torque) const noexcept {
    torque = detail::sized<pal_contact_torque>();
    return pal_session_get_torque(session_, contact, &torque);
  }

  [[nodiscard]] pal_status hold(uint32_t tool, const pal_hold& hold) noexcept {
    return pal_tool_hold(session_, tool, &hold);
  }
  [[nodiscard]] pal_status release(uint32_t tool) noexcept { return pal_tool_release(session_, tool); }
  [[nodiscard]] pal_status set_touch(uint32_t tool, const pal_touch& touch) noexcept {
    return pal_tool_set_touch(session_, tool, &touch);
  }
  // The tool no longer takes hold by itself.
  [[nodiscard]] pal_status clear_touch(uint32_t tool) noexcept {
    return pal_tool_set_touch(session_, tool, nullptr);
  }
  // `poses`: of the first tools. `ages`: as long as `poses`, or empty: 0. `results`: of the first tools.
  [[nodiscard]] pal_status haptic_frame(double dt, std::span<const pal_pose> poses,
                                        std::span<pal_tool_result> results,
                                        std::span<const double> ages = {}) noexcept {
    if (!ages.empty() && ages.size() != poses.size()) return PAL_STATUS_BAD_ARGUMENT;
    auto input = detail::sized<pal_haptic_input>();
    input.num_tools = detail::count_of(poses);
    input.poses = poses.data();
    input.ages = ages.empty() ? nullptr : ages.data();
    input.dt = dt;
    input.result_bytes = sizeof(pal_tool_result);
    input.num_results = detail::count_of(results);
    return pal_haptic_frame(session_, &input, results.data());
  }

  [[nodiscard]] pal_status request_nodes(std::span<const uint32_t> nodes) noexcept {
    return pal_session_request_nodes(session_, nodes.data(), detail::count_of(nodes));
  }
  [[nodiscard]] pal_status visual_frame(pal_real* displacements,
                                        size_t stride_bytes = 3 * sizeof(pal_real)) noexcept {
    return pal_visual_frame(session_, displacements, stride_bytes);
  }

  // May run on the thread of haptic frames, or on one more thread.
  [[nodiscard]] pal_status refine(uint64_t operations = 0) noexcept {
    return pal_session_refine(session_, operations, nullptr);
  }
  [[nodiscard]] pal_status refine(uint64_t operations, pal_refinement& refinement) noexcept {
    refinement.struct_size = sizeof refinement;
    return pal_session_refine(session_, operations, &refinement);
  }

  // `buffer`: aligned to 8.
  [[nodiscard]] pal_status record(void* buffer, size_t buffer_bytes) noexcept {
    return pal_session_record(session_, buffer, buffer_bytes);
  }
  [[nodiscard]] pal_status stop_recording(size_t& bytes, uint32_t* complete = nullptr) noexcept {
    return pal_session_stop_recording(session_, &bytes, complete);
  }
  [[nodiscard]] pal_status replay(const void* recording, size_t bytes, pal_replay& replay) noexcept {
    return pal_session_replay(session_, recording, bytes, &replay);
  }
  [[nodiscard]] static pal_status recorded_config(const void* recording, size_t bytes,
                                                  pal_session_config& config) noexcept {
    config = detail::sized<pal_session_config>();
    return pal_recording_get_config(recording, bytes, &config);
  }
  [[nodiscard]] pal_session* get() const noexcept { return session_; }

 private:
  pal_session* session_ = nullptr;
};

}  // namespace palpate
