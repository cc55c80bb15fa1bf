// A session whose frames are timed: it speaks the runtime's units and does nothing but call it.
#pragma once

#include <span>
#include <vector>

#include "offline/cli/opened_pack.hpp"

namespace palpate {

// With memory of its own. `zone_rings`: 0: all that the pack carries; `zone_iterations`: 0: the runtime's default.
class TimedSession {
 public:
  TimedSession(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts,
               std::uint32_t zone_rings = 0, std::uint32_t zone_iterations = 0)
      : TimedSession(opened, config_of(opened, model, max_contacts, zone_rings, zone_iterations)) {}

  void haptic(std::span<const pal_contact> contacts) {
    require_ok(session_.contact_frame(contacts, {results_.data(), contacts.size()}), "frame");
  }
  // Tool 0 holds a site; a haptic frame of its pose, with the same answer as the contact frame.
  void hold(std::uint32_t site) { require_ok(session_.hold(0, pal_default_hold(site)), "hold"); }
  // Tool 0 looks for the surface as long as it holds nothing.
  void look_for_surface() {
    pal_touch touch = {};
    touch.struct_size = sizeof touch;
    touch.law = PAL_LAW_TOUCH;
    require_ok(session_.set_touch(0, touch), "touch");
  }
  // How many contacts it holds.
  std::uint32_t tool(const pal_pose& pose) {
    pal_tool_result result = {};
    require_ok(session_.haptic_frame(0.001, {&pose, 1}, {&result, 1}), "frame");
    return result.num_contacts;
  }
  void visual(pal_real* field) { require_ok(session_.visual_frame(field), "frame"); }

 private:
  TimedSession(const OpenedPack& opened, const pal_session_config& config)
      : arena_(required_bytes(opened, config)), results_(config.max_contacts) {
    require_ok(session_.init(opened.pack(), config, arena_.bytes()), "session");
  }
  static pal_session_config config_of(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts,
                                      std::uint32_t zone_rings, std::uint32_t zone_iterations) {
    pal_session_config config = pal_default_session_config(opened.pack().get());
    config.zone_rings = zone_rings;
    config.zone_iterations = zone_iterations;
    config.model = model;
    config.max_contacts = max_contacts;
    config.max_tools = 1;
    return config;
  }
  static size_t required_bytes(const OpenedPack& opened, const pal_session_config& config) {
    size_t bytes = 0;
    require_ok(Session::required_bytes(opened.pack(), config, bytes), "session");
    return bytes;
  }

  AlignedBytes arena_;
  std::vector<pal_contact_result> results_;
  Session session_;
};

}  // namespace palpate
