// A session for timing, in the runtime's units. Calls add no work of their own to the runtime's calls.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"

namespace palpate {

// Owns its memory. Zero values mean:
//   `zone_rings`: all rings of the pack,
//   `max_tools`: one.
class TimedSession {
 public:
  TimedSession(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts,
               std::uint32_t zone_rings = 0, std::uint32_t max_tools = 0)
      : TimedSession(opened, config_of(opened, model, max_contacts, zone_rings, max_tools)) {}

  // Runs contact frames until no zone is being prepared. The refining lane works between the frames.
  void haptic(std::span<const pal_contact> contacts) {
    while (!frame_once(contacts)) refine();
  }
  // Runs one contact frame. Returns false where the refining lane has to prepare a zone first.
  bool frame_once(std::span<const pal_contact> contacts) {
    require_ok(session_.contact_frame(contacts, {results_.data(), contacts.size()}), "frame");
    return contacts.empty() || (results_.front().flags & PAL_FLAG_PREPARING) == 0;
  }
  // Attaches a tool to a site. tool() then gives the force of the contact frame at the tool's pose.
  void hold(std::uint32_t site, std::uint32_t tool = 0) {
    require_ok(session_.hold(tool, pal_default_hold(site)), "hold");
  }
  void release(std::uint32_t tool) { require_ok(session_.release(tool), "release"); }
  // Lets tool 0 search the surface for contacts.
  void look_for_surface() {
    pal_touch touch = {};
    touch.struct_size = sizeof touch;
    touch.law = PAL_LAW_TOUCH;
    require_ok(session_.set_touch(0, touch), "touch");
  }
  // Runs a haptic frame of tool 0. Returns the number of contacts that the tool holds.
  std::uint32_t tool(const pal_pose& pose) {
    tools({&pose, 1});
    return tool_results_.front().num_contacts;
  }
  // Runs a haptic frame of the first tools; returns the union of their flags.
  std::uint32_t tools(std::span<const pal_pose> poses) {
    require_ok(session_.haptic_frame(0.001, poses, {tool_results_.data(), poses.size()}), "frame");
    std::uint32_t flags = 0;
    for (size_t tool = 0; tool < poses.size(); ++tool) flags |= tool_results_[tool].flags;
    return flags;
  }
  // Runs the refining lane for so many multiply-adds; 0: until an iteration or a zone is complete.
  void refine(std::uint64_t operations = 0) {
    pal_refinement refinement = {};
    require_ok(session_.refine(operations, refinement), "refine");
  }
  void visual(pal_real* field) { require_ok(session_.visual_frame(field), "frame"); }

 private:
  TimedSession(const OpenedPack& opened, const pal_session_config& config)
      : arena_(required_bytes(opened, config)),
        results_(config.max_contacts),
        tool_results_(config.max_tools) {
    require_ok(session_.init(opened.pack(), config, arena_.bytes()), "session");
  }
  static pal_session_config config_of(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts,
                                      std::uint32_t zone_rings, std::uint32_t max_tools) {
    pal_session_config config = pal_default_session_config(opened.pack().get());
    config.zone_rings = zone_rings;
    config.model = model;
    config.max_contacts = max_contacts;
    config.max_tools = std::max(1u, max_tools);
    return config;
  }
  static size_t required_bytes(const OpenedPack& opened, const pal_session_config& config) {
    size_t bytes = 0;
    require_ok(Session::required_bytes(opened.pack(), config, bytes), "session");
    return bytes;
  }

  AlignedBytes arena_;
  std::vector<pal_contact_result> results_;
  std::vector<pal_tool_result> tool_results_;
  Session session_;
};

}  // namespace palpate
