// Calls that make tools hold, touch and release the tissue.
#include <math.h>
#include <string.h>

#include <palpate/palpate.h>

#include "runtime/src/base/floating_point_mode.hpp"
#include "runtime/src/base/sized_struct.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/response/response.hpp"
#include "runtime/src/session/session_state.hpp"
#include "runtime/src/tools/tool_holds.hpp"

namespace palpate {
namespace {

constexpr uint32_t kFirstHoldBytes = 104;
constexpr uint32_t kFirstTouchBytes = 40;
static_assert(kFirstHoldBytes == sizeof(pal_hold) && kFirstTouchBytes == sizeof(pal_touch));

// Copies the caller's hold to `hold` and adds the defaults. Returns PAL_STATUS_OK if a tool can take the
// hold.
pal_status read_hold(const pal_pack& pack, const pal_hold& given, pal_hold& hold) {
  if (const pal_status status = read_sized(given, kFirstHoldBytes, hold); status != PAL_STATUS_OK)
    return status;
  int law;
  static_assert(sizeof law == sizeof hold.law);
  memcpy(&law, &hold.law, sizeof law);
  if (law != PAL_LAW_BONDED && law != PAL_LAW_TOUCH) return PAL_STATUS_BAD_ARGUMENT;
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    if (!isfinite(hold.weights[i])) return PAL_STATUS_NOT_FINITE;
    if (hold.weights[i] < 0) return PAL_STATUS_BAD_ARGUMENT;
    if (hold.weights[i] > 0 && hold.sites[i] >= pack.num_sites) return PAL_STATUS_NO_SUCH_SITE;
    sum += hold.weights[i];
  }
  constexpr double kRounding = 1e-6;
  if (!(fabs(sum - 1.0) <= kRounding)) return PAL_STATUS_BAD_ARGUMENT;
  if (!read_pose(hold.unstrained, hold.unstrained)) return PAL_STATUS_BAD_ARGUMENT;
  return law == PAL_LAW_TOUCH && pack.site_normals == nullptr ? PAL_STATUS_NO_SUCH_MODEL : PAL_STATUS_OK;
}

}  // namespace
}  // namespace palpate

extern "C" pal_status pal_tool_hold(pal_session* session, uint32_t tool, const pal_hold* given) noexcept {
  if (session == nullptr || given == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (tool >= session->config.max_tools) return PAL_STATUS_NO_SUCH_TOOL;
  const palpate::FloatingPointMode mode;
  pal_hold hold = {};
  if (const pal_status status = palpate::read_hold(*session->tissue.pack, *given, hold);
      status != PAL_STATUS_OK)
    return status;
  const uint32_t held = session->tools.num_contacts;
  if (held >= session->config.max_contacts) return PAL_STATUS_CAPACITY_EXCEEDED;
  if (!palpate::can_answer(session->tissue, held + 1)) return PAL_STATUS_MODEL_CANNOT_ANSWER;
  palpate::use_tool(session->tools, tool);
  palpate::take_hold(session->tissue, tool, hold, session->tools);
  session->used = true;
  palpate::record_hold(*session, tool, hold);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_tool_release(pal_session* session, uint32_t tool) noexcept {
  if (session == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (tool >= session->config.max_tools) return PAL_STATUS_NO_SUCH_TOOL;
  palpate::release_contacts(tool, session->tools);
  session->used = true;
  palpate::record_release(*session, tool);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_tool_set_touch(pal_session* session, uint32_t tool,
                                         const pal_touch* given) noexcept {
  if (session == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (tool >= session->config.max_tools) return PAL_STATUS_NO_SUCH_TOOL;
  palpate::ToolState& state = session->tools.tools[tool];
  if (given == nullptr) {
    state.touches = false;
    session->used = true;
    palpate::record_touch(*session, tool, nullptr);
    return PAL_STATUS_OK;
  }
  if (session->tissue.pack->site_normals == nullptr) return PAL_STATUS_NO_SUCH_MODEL;
  const palpate::FloatingPointMode mode;
  pal_touch touch = {};
  if (const pal_status status = palpate::read_sized(*given, palpate::kFirstTouchBytes, touch);
      status != PAL_STATUS_OK)
    return status;
  int law;
  memcpy(&law, &touch.law, sizeof law);
  if (law != PAL_LAW_BONDED && law != PAL_LAW_TOUCH) return PAL_STATUS_BAD_ARGUMENT;
  for (const double number : {touch.tip[0], touch.tip[1], touch.tip[2], touch.distance}) {
    if (!(fabs(number) <= palpate::kMostPosition)) return PAL_STATUS_NOT_FINITE;
  }
  if (touch.distance < 0) return PAL_STATUS_BAD_ARGUMENT;
  palpate::use_tool(session->tools, tool);
  state.touch = touch;
  state.touches = true;
  session->used = true;
  palpate::record_touch(*session, tool, &touch);
  return PAL_STATUS_OK;
}
