// C++ face of palpate.h: the calls of a simulation as member functions, closing the pack when it goes out of
// scope. No behaviour of its own, no exceptions, no allocation.
#pragma once

#include <palpate/palpate.h>

#include <span>

namespace palpate {

class Pack {
 public:
  Pack() = default;
  ~Pack() { pal_pack_close(pack_); }
  Pack(const Pack&) = delete;
  Pack& operator=(const Pack&) = delete;

  [[nodiscard]] pal_status open(const char* path, pal_verify verify = PAL_VERIFY_ONCE) noexcept {
    pal_pack_close(pack_);
    pack_ = nullptr;
    return pal_pack_open(path, verify, storage_, sizeof storage_, &pack_);
  }
  [[nodiscard]] pal_status open_memory(const void* bytes, size_t num_bytes,
                                       pal_verify verify = PAL_VERIFY_ONCE) noexcept {
    pal_pack_close(pack_);
    pack_ = nullptr;
    return pal_pack_open_memory(bytes, num_bytes, verify, storage_, sizeof storage_, &pack_);
  }
  [[nodiscard]] pal_pack_info info() const noexcept {
    pal_pack_info info = {};
    info.struct_size = sizeof info;
    if (pal_pack_get_info(pack_, &info) != PAL_STATUS_OK) return {};
    return info;
  }
  [[nodiscard]] pal_geometry geometry() const noexcept {
    pal_geometry geometry = {};
    geometry.struct_size = sizeof geometry;
    if (pal_pack_get_geometry(pack_, &geometry) != PAL_STATUS_OK) return {};
    return geometry;
  }
  [[nodiscard]] pal_status find_site(int32_t node_label, uint32_t& site) const noexcept {
    return pal_pack_find_site(pack_, node_label, &site);
  }
  [[nodiscard]] pal_status find_surface_point(const double position[3],
                                              pal_surface_point& point) const noexcept {
    return pal_pack_find_surface_point(pack_, position, &point);
  }
  [[nodiscard]] const pal_pack* get() const noexcept { return pack_; }

 private:
  alignas(16) unsigned char storage_[PAL_PACK_STORAGE_BYTES] = {};
  pal_pack* pack_ = nullptr;
};

class Session {
 public:
  [[nodiscard]] static pal_status required_bytes(const Pack& pack, const pal_session_config& config,
                                                 size_t& bytes) noexcept {
    return pal_session_required_bytes(pack.get(), &config, &bytes);
  }
  [[nodiscard]] pal_status init(const Pack& pack, const pal_session_config& config,
                                std::span<unsigned char> arena) noexcept {
    return pal_session_init(pack.get(), &config, arena.data(), arena.size(), &session_);
  }
  [[nodiscard]] pal_status set_fixed(std::span<const uint32_t> contact_nodes) noexcept {
    return pal_session_set_fixed(session_, contact_nodes.data(), static_cast<uint32_t>(contact_nodes.size()));
  }
  [[nodiscard]] pal_status record(void* buffer, size_t buffer_bytes) noexcept {
    return pal_session_record(session_, buffer, buffer_bytes);
  }
  [[nodiscard]] pal_status stop_recording(size_t& bytes, uint32_t* complete = nullptr) noexcept {
    return pal_session_stop_recording(session_, &bytes, complete);
  }
  // `results` must be as long as `contacts`.
  [[nodiscard]] pal_status contact_frame(std::span<const pal_contact> contacts,
                                         std::span<pal_contact_result> results) noexcept {
    if (results.size() != contacts.size()) return PAL_STATUS_BAD_ARGUMENT;
    return pal_contact_frame(session_, contacts.data(), static_cast<uint32_t>(contacts.size()),
                             results.data());
  }
  [[nodiscard]] pal_status hold(uint32_t tool, const pal_hold& hold) noexcept {
    return pal_tool_hold(session_, tool, &hold);
  }
  [[nodiscard]] pal_status release(uint32_t tool) noexcept { return pal_tool_release(session_, tool); }
  [[nodiscard]] pal_status set_touch(uint32_t tool, const pal_touch& touch) noexcept {
    return pal_tool_set_touch(session_, tool, &touch);
  }
  // Poses of the first tools, just measured; results of as many tools as there is room for.
  [[nodiscard]] pal_status haptic_frame(double dt, std::span<const pal_pose> poses,
                                        std::span<pal_tool_result> results) noexcept {
    pal_haptic_input input = {};
    input.struct_size = sizeof input;
    input.num_tools = static_cast<uint32_t>(poses.size());
    input.poses = poses.data();
    input.dt = dt;
    input.result_bytes = sizeof(pal_tool_result);
    input.num_results = static_cast<uint32_t>(results.size());
    return pal_haptic_frame(session_, &input, results.data());
  }
  [[nodiscard]] pal_status request_nodes(std::span<const uint32_t> nodes) noexcept {
    return pal_session_request_nodes(session_, nodes.data(), static_cast<uint32_t>(nodes.size()));
  }
  [[nodiscard]] pal_status visual_frame(pal_real* displacements,
                                        size_t stride_bytes = 3 * sizeof(pal_real)) noexcept {
    return pal_visual_frame(session_, displacements, stride_bytes);
  }
  [[nodiscard]] pal_session* get() const noexcept { return session_; }

 private:
  pal_session* session_ = nullptr;
};

}  // namespace palpate
