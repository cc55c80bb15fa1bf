// One simulation: its memory and its two frames.
#include <string.h>

#include <math.h>

#include <palpate/palpate.h>

#include <algorithm>

#include "runtime/src/base/arena.hpp"
#include "runtime/src/base/floating_point_mode.hpp"
#include "runtime/src/base/sized_struct.hpp"
#include "runtime/src/linear/linear_point.hpp"
#include "runtime/src/numerics/pose.hpp"
#include "runtime/src/pack/compliance.hpp"
#include "runtime/src/pack/compressed_compliance.hpp"
#include "runtime/src/pack/contact_place.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/polynomial/polynomial_field.hpp"
#include "runtime/src/refining/refinement.hpp"
#include "runtime/src/response/response.hpp"
#include "runtime/src/response/response_at_point.hpp"
#include "runtime/src/session/session_state.hpp"
#include "runtime/src/tools/force_limits.hpp"

namespace palpate {
namespace {

constexpr uint32_t kMostZoneIterations = 16;
constexpr uint32_t kUsualZoneIterations = 4;
constexpr uint32_t kFirstInputBytes = 40;
constexpr uint32_t kFirstResultBytes = 152;
constexpr uint32_t kFirstCounterBytes = 72;
static_assert(kFirstConfigBytes <= sizeof(pal_session_config) &&
              kFirstInputBytes == sizeof(pal_haptic_input) && kFirstResultBytes == sizeof(pal_tool_result) &&
              kFirstCounterBytes == sizeof(pal_counters));

bool has_zone(const pal_pack& pack, const pal_session_config& config) {
  return pack.organ.nodes != nullptr && (config.model == PAL_MODEL_AUTO || config.model == PAL_MODEL_ZONE);
}

// Takes the session and its arrays from the arena. Sets the pointers in `arrays`. Returns the session.
pal_session* carve_session(const pal_pack& pack, const pal_session_config& config, Arena& arena,
                           pal_session& arrays) {
  pal_session* session = arena.take<pal_session>(1);
  arrays.tissue.fixed = arena.take<uint32_t>(config.max_fixed);
  arrays.requested = arena.take<uint32_t>(config.max_requested);
  if (is_compressed(pack)) arrays.requested_by_panel = arena.take<uint32_t>(config.max_requested);
  arrays.tissue.displacements =
      arena.take<double>(size_t{config.patches_turn != 0 ? 6u : 3u} * config.max_contacts);
  arrays.turns = arena.take<double>(config.patches_turn != 0 ? size_t{3} * config.max_contacts : 0);
  arrays.tissue.forces = arena.take<double>(size_t{3} * config.max_contacts);
  arrays.tissue.input_flags = arena.take<uint32_t>(config.max_contacts);
  arrays.tissue.given_axes = arena.take<uint32_t>(config.max_contacts);
  arrays.tissue.given_forces = arena.take<double>(size_t{3} * config.max_contacts);
  LinearState& linear = arrays.tissue.linear;
  if (pack.field_compliance != nullptr && !is_nonlinear_only(config.model)) {
    carve_linear(pack, config.max_contacts, config.max_fixed, arena, linear);
  } else if (has_zone(pack, config)) {
    // linear_dd answers until a zone is prepared, and transfers responses to contacts between sites.
    carve_linear(pack, std::min(config.max_contacts, kMostZoneContacts), config.max_fixed, arena, linear);
  }
  const uint32_t held_at_point = pack.field_compliance != nullptr ? most_held_at_point(pack) : 0;
  uint32_t most_held = held_at_point > linear.max_shown ? held_at_point : linear.max_shown;
  uint32_t most_zone_nodes = 0;
  uint32_t most_zone_contacts = 0;
  if (has_zone(pack, config)) {
    const ZoneRoom room =
        zone_room(pack, config.max_contacts, config.max_fixed, config.zone_rings, config.patches_turn != 0);
    carve_zone(pack, room, arena, arrays.tissue.zone);
    carve_refinement(pack, room, arena, arrays.tissue.refinement);
    // A zone's field includes the transfers to the contacts' places, and linear_dd of all contacts.
    const uint32_t held_in_transfers = room.contacts * kMostCorners * pack.max_patch_nodes;
    most_held = std::max(most_held, held_in_transfers + linear.max_shown);
    most_zone_nodes = room.nodes;
    most_zone_contacts = room.contacts;
  }
  for (FieldState& slot : arrays.tissue.snapshots.slots) {
    slot.corners = arena.take<PolynomialFieldState>(
        pack.polynomial_sites != nullptr ? most_corners(most_zone_contacts) : 0);
    slot.own_nodes = arena.take<uint32_t>(most_zone_nodes);
    slot.own = arena.take<pal_real>(size_t{3} * most_zone_nodes);
    slot.held = arena.take<uint32_t>(most_held);
    slot.weights = arena.take<pal_real>(size_t{3} * most_held);
  }
  for (FieldState& slot : arrays.tissue.snapshots.slots) slot.refined_field = slot.response = kNoField;
  reset_snapshots(arrays.tissue.snapshots);
  carve_tools(config, arena, arrays.tools);
  return session;
}

pal_session_config default_config(const pal_pack* pack) {
  pal_session_config config = {};
  config.struct_size = sizeof config;
  config.max_contacts = pack == nullptr ? 1 : pack->max_contacts;
  config.model = PAL_MODEL_AUTO;
  config.max_tools = 4;
  config.organ.orientation[0] = 1;
  config.blend_seconds = 0.01;
  config.stale_seconds = 0.05;
  config.ramp_seconds = 0.05;
  return config;
}

// Checks that the pack carries the model that a config requests.
pal_status check_model(const pal_pack& pack, const pal_session_config& config) {
  int model;  // a C program may pass any integer, and loading such an enumeration is undefined behaviour
  static_assert(sizeof model == sizeof config.model);
  memcpy(&model, &config.model, sizeof model);
  switch (model) {
    case PAL_MODEL_AUTO:
      return PAL_STATUS_OK;
    case PAL_MODEL_LINEAR:
      return pack.field_compliance != nullptr ? PAL_STATUS_OK : PAL_STATUS_NO_SUCH_MODEL;
    case PAL_MODEL_POLYNOMIAL:
    case PAL_MODEL_AFFINE:
      return pack.polynomial_sites != nullptr ? PAL_STATUS_OK : PAL_STATUS_NO_SUCH_MODEL;
    case PAL_MODEL_ZONE:
      return pack.organ.nodes != nullptr ? PAL_STATUS_OK : PAL_STATUS_NO_SUCH_MODEL;
  }
  return PAL_STATUS_BAD_ARGUMENT;
}

// Copies the caller's config to `config` and adds the defaults.
pal_status read_config(const pal_pack* pack, const pal_session_config* given, pal_session_config& config) {
  if (pack == nullptr || given == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  const FloatingPointMode mode;
  config = default_config(pack);
  if (const pal_status status = read_sized(*given, kFirstConfigBytes, config); status != PAL_STATUS_OK)
    return status;
  if (config.max_contacts < 1 || config.max_contacts > pack::kMostContacts || config.max_fixed > kMostFixed ||
      config.max_tools > kMostTools || config.max_requested > pack->num_nodes)
    return PAL_STATUS_BAD_ARGUMENT;
  for (const double number : {config.blend_seconds, config.stale_seconds, config.ramp_seconds}) {
    if (!(number >= 0 && isfinite(number))) return PAL_STATUS_BAD_ARGUMENT;
  }
  for (const double limit :
       {config.max_force, config.max_force_rate, config.max_torque, config.max_torque_rate}) {
    if (!(limit >= 0)) return PAL_STATUS_BAD_ARGUMENT;
  }
  fill_limits(*pack, config);
  if (config.zone_rings > pack->zone_rings || config.zone_iterations > kMostZoneIterations)
    return PAL_STATUS_BAD_ARGUMENT;
  if (config.zone_rings == 0) config.zone_rings = pack->zone_rings;
  if (config.zone_iterations == 0) config.zone_iterations = kUsualZoneIterations;
  if (config.patches_turn > 1 || config.reserved != 0) return PAL_STATUS_BAD_ARGUMENT;
  if (!read_pose(config.organ, config.organ)) return PAL_STATUS_BAD_ARGUMENT;
  if (const pal_status status = check_model(*pack, config); status != PAL_STATUS_OK) return status;
  return config.patches_turn == 0 || has_zone(*pack, config) ? PAL_STATUS_OK : PAL_STATUS_NO_SUCH_MODEL;
}

// Counts the bytes by carving a session from an arena without memory.
size_t required_bytes(const pal_pack& pack, const pal_session_config& config) {
  Arena counting(nullptr);
  pal_session arrays = {};
  carve_session(pack, config, counting, arrays);
  return counting.used();
}

// Counts the frames in which any tool had a flag.
void count_frame(const pal_tool_result* results, uint32_t count, bool switched, pal_counters& counters) {
  uint32_t flags = 0;
  for (uint32_t tool = 0; tool < count; ++tool) flags |= results[tool].flags;
  ++counters.frames;
  counters.switches += switched ? 1 : 0;
  if (flags == 0) return;
  const auto has = [&](uint32_t flag) -> uint64_t { return (flags & flag) != 0 ? 1 : 0; };
  counters.preparing += has(PAL_FLAG_PREPARING);
  counters.extrapolated += has(PAL_FLAG_EXTRAPOLATED);
  counters.bad_input += has(PAL_FLAG_BAD_INPUT);
  counters.stale += has(PAL_FLAG_STALE);
  counters.limited += has(PAL_FLAG_LIMITED);
  counters.reduced += has(PAL_FLAG_REDUCED);
}

// Copies the results into the caller's array, whose entries may be longer than pal_tool_result.
void copy_results(const pal_tool_result* from, uint32_t count, uint32_t result_bytes,
                  pal_tool_result* results) {
  unsigned char* to = reinterpret_cast<unsigned char*>(results);
  for (uint32_t tool = 0; tool < count; ++tool, to += result_bytes) {
    memcpy(to, from + tool, sizeof *from);
    if (result_bytes > sizeof *from) memset(to + sizeof *from, 0, result_bytes - sizeof *from);
  }
}

}  // namespace
}  // namespace palpate

extern "C" pal_status pal_session_fill_config(const pal_pack* pack, pal_session_config* config) noexcept {
  if (config == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  const palpate::FloatingPointMode mode;
  pal_session_config defaults = palpate::default_config(pack);
  if (pack != nullptr) palpate::fill_limits(*pack, defaults);
  return palpate::write_sized(defaults, palpate::kFirstConfigBytes, *config);
}

extern "C" pal_status pal_session_required_bytes(const pal_pack* pack, const pal_session_config* config,
                                                 size_t* bytes) noexcept {
  if (bytes == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  pal_session_config complete;
  if (const pal_status status = palpate::read_config(pack, config, complete); status != PAL_STATUS_OK)
    return status;
  *bytes = palpate::required_bytes(*pack, complete);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_session_init(const pal_pack* pack, const pal_session_config* config, void* arena,
                                       size_t arena_bytes, pal_session** session) noexcept {
  if (arena == nullptr || session == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  const palpate::FloatingPointMode mode;
  pal_session_config complete;
  if (const pal_status status = palpate::read_config(pack, config, complete); status != PAL_STATUS_OK)
    return status;
  const size_t required = palpate::required_bytes(*pack, complete);
  if (arena_bytes < required) return PAL_STATUS_ARENA_TOO_SMALL;
  if (reinterpret_cast<uintptr_t>(arena) % palpate::Arena::kAlignment != 0)
    return PAL_STATUS_ARENA_MISALIGNED;
  memset(arena, 0, required);  // also touches every page before the first frame
  palpate::Arena memory(arena);
  pal_session initial = {};
  pal_session* place = palpate::carve_session(*pack, complete, memory, initial);
  initial.config = complete;
  initial.tissue.pack = pack;
  initial.tissue.config = &place->config;
  initial.tissue.kernel = palpate::choose_field_kernel();
  initial.tissue.linear.assembly.inverse.kernel = palpate::choose_inverse_kernel();
  initial.tissue.zone.kernel = palpate::choose_elimination_kernel();
  initial.tissue.zone.is_bounded = complete.budget_operations > 0;
  initial.tissue.operations = complete.budget_operations > 0 ? complete.budget_operations : UINT64_MAX;
  for (uint32_t tool = 0; tool < complete.max_tools; ++tool) palpate::reset_tool(initial.tools.tools[tool]);
  palpate::reset_passivity(initial.tools.passivity);
  if (palpate::has_zone(*pack, complete)) palpate::fill_refinement(*pack, initial.tissue.refinement);
  memcpy(static_cast<void*>(place), &initial, sizeof initial);
  *session = place;
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_session_get_counters(const pal_session* session, pal_counters* counters) noexcept {
  if (session == nullptr || counters == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  return palpate::write_sized(session->counters, palpate::kFirstCounterBytes, *counters);
}

extern "C" pal_status pal_session_get_config(const pal_session* session,
                                             pal_session_config* config) noexcept {
  if (session == nullptr || config == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  return palpate::write_sized(session->config, palpate::kFirstConfigBytes, *config);
}

extern "C" pal_status pal_contact_frame(pal_session* session, const pal_contact* contacts, uint32_t count,
                                        pal_contact_result* results) noexcept {
  if (session == nullptr || (contacts == nullptr && count > 0)) return PAL_STATUS_NULL_ARGUMENT;
  if (count > session->config.max_contacts) return PAL_STATUS_CAPACITY_EXCEEDED;
  const palpate::FloatingPointMode mode;
  bool forces_given = false;
  for (uint32_t c = 0; c < count; ++c) {
    const pal_contact& contact = contacts[c];
    if (contact.force_axes > palpate::kAllAxes) return PAL_STATUS_BAD_ARGUMENT;
    if (const pal_status status = palpate::check_place(*session->tissue.pack, contact);
        status != PAL_STATUS_OK)
      return status;
    forces_given = forces_given || contact.force_axes != 0;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const bool by_force = (contact.force_axes >> axis & 1) != 0;
      if (!isfinite(by_force ? contact.force[axis] : contact.displacement[axis]))
        return PAL_STATUS_NOT_FINITE;
    }
  }
  if (!palpate::can_answer(session->tissue, count, forces_given)) return PAL_STATUS_MODEL_CANNOT_ANSWER;
  session->used = true;
  // A recording needs results even when the caller wants none.
  if (results == nullptr) results = session->tools.results;
  palpate::TissueState& tissue = session->tissue;
  palpate::take_from_lane(tissue);
  palpate::ResponseKind kind = palpate::select_response(tissue, contacts, count, forces_given);
  const bool is_prepared = palpate::prepare(tissue, kind, contacts, count);
  if (!is_prepared) {
    kind = palpate::select_linear(tissue, contacts, count, forces_given);
    palpate::prepare(tissue, kind, contacts, count);
  }
  palpate::answer_contacts(tissue, kind, contacts, count, session->turns, results, !is_prepared);
  for (uint32_t c = 0; c < count && !is_prepared; ++c)
    results[c].flags |= PAL_FLAG_PREPARING | PAL_FLAG_UNREFINED;
  session->by_contacts = true;
  palpate::record_contact_frame(*session, contacts, count, results);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_haptic_frame(pal_session* session, const pal_haptic_input* given,
                                       pal_tool_result* results) noexcept {
  if (session == nullptr || given == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  pal_haptic_input input = {};
  if (const pal_status status = palpate::read_sized(*given, palpate::kFirstInputBytes, input);
      status != PAL_STATUS_OK)
    return status;
  const uint32_t max_tools = session->config.max_tools;
  if (input.num_tools > max_tools) return PAL_STATUS_NO_SUCH_TOOL;
  if (input.poses == nullptr && input.num_tools > 0) return PAL_STATUS_NULL_ARGUMENT;
  if (results != nullptr && (input.result_bytes < palpate::kFirstResultBytes ||
                             input.result_bytes > palpate::kLargestStruct || input.result_bytes % 8 != 0))
    return PAL_STATUS_BAD_STRUCT_SIZE;
  const palpate::FloatingPointMode mode;
  session->used = true;
  session->by_contacts = false;
  const uint32_t num_results = results == nullptr ? 0 : std::min(input.num_results, max_tools);
  pal_tool_result local[palpate::kMostTools];
  const bool in_place =
      results != nullptr && input.result_bytes == sizeof *results && num_results == max_tools;
  pal_tool_result* all = in_place ? results : local;
  palpate::answer_tools(input, session->tissue, session->tools, all);
  palpate::count_frame(all, session->tools.num_used, session->tools.changed, session->counters);
  palpate::record_haptic_frame(*session, input, all);
  if (!in_place) palpate::copy_results(all, num_results, input.result_bytes, results);
  return PAL_STATUS_OK;
}
