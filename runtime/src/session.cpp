// One simulation: its memory, and its two frames.
#include <string.h>

#include <math.h>

#include <palpate/palpate.h>

#include <algorithm>

#include "runtime/src/arena.hpp"
#include "runtime/src/calibration.hpp"
#include "runtime/src/compliance.hpp"
#include "runtime/src/compressed_compliance.hpp"
#include "runtime/src/contact_place.hpp"
#include "runtime/src/floating_point_mode.hpp"
#include "runtime/src/force_limits.hpp"
#include "runtime/src/gravity.hpp"
#include "runtime/src/linear_point.hpp"
#include "runtime/src/pack_view.hpp"
#include "runtime/src/place_answer.hpp"
#include "runtime/src/polynomial_field.hpp"
#include "runtime/src/pose.hpp"
#include "runtime/src/response.hpp"
#include "runtime/src/rising_search.hpp"
#include "runtime/src/session_state.hpp"
#include "runtime/src/sized_struct.hpp"
#include "runtime/src/zone_exterior.hpp"

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
  return pack.zone_nodes != nullptr && (config.model == PAL_MODEL_AUTO || config.model == PAL_MODEL_ZONE);
}

pal_session* carve_session(const pal_pack& pack, const pal_session_config& config, Arena& arena,
                           pal_session& arrays) {
  pal_session* session = arena.take<pal_session>(1);
  arrays.fixed = arena.take<uint32_t>(config.max_fixed);
  arrays.requested = arena.take<uint32_t>(config.max_requested);
  if (is_compressed(pack)) arrays.requested_by_panel = arena.take<uint32_t>(config.max_requested);
  arrays.displacements = arena.take<double>(size_t{config.patches_turn != 0 ? 6u : 3u} * config.max_contacts);
  arrays.turns = arena.take<double>(config.patches_turn != 0 ? size_t{3} * config.max_contacts : 0);
  arrays.forces = arena.take<double>(size_t{3} * config.max_contacts);
  arrays.input_flags = arena.take<uint32_t>(config.max_contacts);
  arrays.given_axes = arena.take<uint32_t>(config.max_contacts);
  arrays.given_forces = arena.take<double>(size_t{3} * config.max_contacts);
  LinearState& linear = arrays.linear;
  if (pack.field_compliance != nullptr && !is_nonlinear_alone(config.model)) {
    carve_linear(pack, config.max_contacts, config.max_fixed, arena, linear);
  } else if (has_zone(pack, config) && config.max_contacts + config.max_fixed > 1) {
    // To move contacts of zones.
    carve_linear(pack, std::min(config.max_contacts, kMostBetween), config.max_fixed, arena, linear);
  }
  const uint32_t at_point = pack.field_compliance != nullptr ? most_held_at_point(pack) : 0;
  uint32_t most_held = at_point > linear.max_shown ? at_point : linear.max_shown;
  uint32_t most_own = 0;
  uint32_t most_exterior = 0;
  if (has_zone(pack, config)) {
    carve_zone(pack, config.max_contacts, config.max_fixed, config.zone_rings, config.patches_turn != 0,
               arena, arrays.zone);
    const uint32_t of_zone = arrays.zone.max_boundary + arrays.zone.max_rim_nodes +
                             arrays.zone.max_contacts * kMostCorners * pack.max_patch_nodes +
                             linear.max_shown;
    most_held = of_zone > most_held ? of_zone : most_held;
    most_own = arrays.zone.max_nodes;
    most_exterior = arrays.zone.max_contacts;
  }
  for (FieldState& slot : arrays.snapshots.slots) {
    slot.corners =
        arena.take<PolynomialFieldState>(pack.polynomial_sites != nullptr ? most_corners(most_exterior) : 0);
    slot.own_nodes = arena.take<uint32_t>(most_own);
    slot.own = arena.take<pal_real>(size_t{3} * most_own);
    slot.held = arena.take<uint32_t>(most_held);
    slot.weights = arena.take<pal_real>(size_t{3} * most_held);
    slot.exterior_sites = arena.take<uint32_t>(most_exterior);
    slot.exterior_weights = arena.take<pal_real>(num_exterior_columns(pack, most_exterior));
  }
  reset_snapshots(arrays.snapshots);
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

// Whether the pack carries the model that a config asks for.
pal_status check_model(const pal_pack& pack, const pal_session_config& config) {
  int model;  // a C program may pass any integer, which it would be undefined to load as the enumeration
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
      return pack.zone_nodes != nullptr ? PAL_STATUS_OK : PAL_STATUS_NO_SUCH_MODEL;
  }
  return PAL_STATUS_BAD_ARGUMENT;
}

// `config` becomes the caller's, completed by the defaults.
pal_status read_config(const pal_pack* pack, const pal_session_config* given, pal_session_config& config) {
  if (pack == nullptr || given == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  const FloatingPointMode mode;
  config = default_config(pack);
  if (const pal_status status = read_sized(*given, kFirstConfigBytes, config); status != PAL_STATUS_OK)
    return status;
  if (config.max_contacts < 1 || config.max_contacts > pack::kMostContacts || config.max_fixed > kMostFixed ||
      config.max_tools > kMostTools || config.max_requested > pack->num_nodes)
    return PAL_STATUS_BAD_ARGUMENT;
  for (const double number : {config.blend_seconds, config.stale_seconds, config.ramp_seconds,
                              config.budget_seconds, config.seconds_per_operation}) {
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
  if (config.budget_seconds > 0 && config.seconds_per_operation == 0 && config.clock == nullptr)
    return PAL_STATUS_BAD_ARGUMENT;
  if (const pal_status status = check_model(*pack, config); status != PAL_STATUS_OK) return status;
  return config.patches_turn == 0 || has_zone(*pack, config) ? PAL_STATUS_OK : PAL_STATUS_NO_SUCH_MODEL;
}

// Multiply-adds that a haptic frame may spend on making a model ready.
uint64_t operations_within(const pal_session_config& config) {
  if (config.budget_seconds == 0) return UINT64_MAX;
  const double operations = config.budget_seconds / config.seconds_per_operation;
  constexpr double kMost = 1e18;
  return operations < 1 ? 1 : static_cast<uint64_t>(operations < kMost ? operations : kMost);
}

size_t required_bytes(const pal_pack& pack, const pal_session_config& config) {
  Arena counting(nullptr);
  pal_session arrays = {};
  carve_session(pack, config, counting, arrays);
  return counting.used();
}

// Panels of which all nodes are shown are made so many at a time: their sums stay in the nearest caches.
constexpr uint32_t kPanelsAtOnce = kMostPanelsAtOnce;

const pal_real* turn_of(const FieldState& field) {
  return field.gravity_turned ? field.gravity_turn : nullptr;
}

bool has_corners(const FieldState& field) {
  return field.model == PAL_MODEL_POLYNOMIAL || field.model == PAL_MODEL_ZONE;
}

// A field and what is made of it once for all its panels.
struct ShownField {
  const FieldState& state;
  const WeighedColumns* corners;  // [num_corners]
};

// The nodes in a nonlinear zone, over what the linear organ makes of them.
void write_own_nodes(const FieldState& field, uint32_t first, uint32_t count, pal_real* sum) {
  for (uint32_t i = 0; i < field.num_own; ++i) {
    const uint32_t place = field.own_nodes[i] - first * pack::kPanelNodes;
    if (place < count * pack::kPanelNodes)
      memcpy(sum + size_t{3} * place, field.own + size_t{3} * i, 3 * sizeof *sum);
  }
}

// sum = displacements of the nodes of `count` panels from `first` on.
void fill_panels(const pal_session& session, const ShownField& shown, uint32_t first, uint32_t count,
                 pal_real* sum) {
  const FieldState& field = shown.state;
  const pal_pack& pack = *session.pack;
  bool onto = fill_rest(session, turn_of(field), first, count, sum);
  if (field.model == PAL_MODEL_LINEAR || field.model == PAL_MODEL_ZONE) {
    fill_compliance_field(pack, field.forces(), first, count, session.kernel, onto, sum);
    onto = true;
  }
  if (field.model == PAL_MODEL_ZONE) {
    add_exterior_field(pack, field, first, count, session.kernel, sum);
    write_own_nodes(field, first, count, sum);
    fill_compliance_field(pack, field.moving_forces(), first, count, session.kernel, true, sum);
  }
  if (has_corners(field)) {
    for (uint32_t i = 0; i < field.num_corners; ++i, onto = true)
      fill_columns(shown.corners[i], first, count, session.kernel, onto, sum);
  }
  if (!onto) clear_panels(count, sum);
}

// Whether fill_panels writes each row once and reads none: the caller's memory may be such as is slow to read.
bool writes_once(const pal_session& session, const FieldState& field) {
  return !session.pack->has_gravity && field.model != PAL_MODEL_ZONE &&
         (field.model != PAL_MODEL_LINEAR || field.num_held <= 1) &&
         (field.model != PAL_MODEL_POLYNOMIAL || field.num_corners == 1);
}

constexpr size_t kNodeBytes = 3 * sizeof(pal_real);

// Writes the first nodes of `rows` to `out` and returns what is behind them.
char* write_nodes(const pal_real* rows, uint32_t count, size_t stride_bytes, char* out) {
  if (stride_bytes == kNodeBytes) {
    memcpy(out, rows, count * kNodeBytes);
  } else {
    for (uint32_t node = 0; node < count; ++node)
      memcpy(out + node * stride_bytes, rows + size_t{3} * node, kNodeBytes);
  }
  return out + count * stride_bytes;
}

// The panels of most fields hold nodes that follow one another.
void write_fields_in_order(const pal_session& session, const FieldState& field, size_t stride_bytes,
                           char* out) {
  WeighedColumns corners[most_corners(kMostZoneContacts)];
  for (uint32_t i = 0; has_corners(field) && i < field.num_corners; ++i)
    weigh_polynomial(*session.pack, field.corners[i], corners[i]);
  const ShownField shown = {field, corners};
  alignas(64) pal_real rows[kPanelsAtOnce * pack::kPanelRows];
  if (session.num_requested == 0) {
    // Whole panels straight to where the caller wants them, if his nodes lie as ours do.
    const bool direct = stride_bytes == kNodeBytes && writes_once(session, field) &&
                        reinterpret_cast<uintptr_t>(out) % alignof(pal_real) == 0;
    uint32_t left = session.pack->num_nodes;
    for (uint32_t first = 0; left > 0;) {
      const bool into_rows = !direct || left < pack::kPanelNodes;
      const uint32_t panels = into_rows ? pack::num_panels(left) : left / pack::kPanelNodes;
      const uint32_t count = panels < kPanelsAtOnce ? panels : kPanelsAtOnce;
      const uint32_t nodes = count * pack::kPanelNodes < left ? count * pack::kPanelNodes : left;
      fill_panels(session, shown, first, count, into_rows ? rows : reinterpret_cast<pal_real*>(out));
      out = into_rows ? write_nodes(rows, nodes, stride_bytes, out) : out + nodes * kNodeBytes;
      first += count;
      left -= nodes;
    }
    return;
  }
  uint32_t filled = UINT32_MAX;
  for (uint32_t i = 0; i < session.num_requested; ++i) {
    const uint32_t node = session.requested[i];
    const uint32_t wanted = node / pack::kPanelNodes;
    if (wanted != filled) fill_panels(session, shown, wanted, 1, rows);
    filled = wanted;
    out = write_nodes(rows + size_t{3} * (node % pack::kPanelNodes), 1, stride_bytes, out);
  }
}

// Those of a compressed compliance hold neighbours in space, whose places in `out` are anywhere.
void write_fields_by_panel(const pal_session& session, const FieldState& field, size_t stride_bytes,
                           char* out) {
  const pal_pack& pack = *session.pack;
  alignas(64) pal_real rows[kPanelsAtOnce * pack::kPanelRows];
  if (session.num_requested == 0) {
    for (uint32_t first = 0; first < pack.num_panels; first += kPanelsAtOnce) {
      const uint32_t left = pack.num_panels - first;
      const uint32_t count = left < kPanelsAtOnce ? left : kPanelsAtOnce;
      fill_compressed_field(pack, field, first, count, session.kernel.add_columns, rows);
      for (uint32_t place = 0; place < count * pack::kPanelNodes; ++place) {
        const uint32_t node =
            pack.compressed_panels[first + place / pack::kPanelNodes].nodes[place % pack::kPanelNodes];
        if (node == pack::kNoNode) continue;
        add_rest(session, turn_of(field), node, rows + size_t{3} * place);
        write_nodes(rows + size_t{3} * place, 1, stride_bytes, out + node * stride_bytes);
      }
    }
    return;
  }
  uint32_t filled = UINT32_MAX;
  for (uint32_t i = 0; i < session.num_requested; ++i) {
    const uint32_t index = session.requested_by_panel[i];
    const uint32_t place = pack.node_places[session.requested[index]];
    const uint32_t wanted = place / pack::kPanelNodes;
    if (wanted != filled) fill_compressed_field(pack, field, wanted, 1, session.kernel.add_columns, rows);
    filled = wanted;
    pal_real* node_rows = rows + size_t{3} * (place % pack::kPanelNodes);
    add_rest(session, turn_of(field), session.requested[index], node_rows);
    write_nodes(node_rows, 1, stride_bytes, out + index * stride_bytes);
  }
}

// Looks every node of the panels up among those requested.
void order_by_panel(pal_session& session) {
  uint32_t found = 0;
  for (uint32_t panel = 0; panel < session.pack->num_panels; ++panel) {
    for (const uint32_t node : session.pack->compressed_panels[panel].nodes) {
      const uint32_t place =
          find_rising(session.num_requested, node, [&](uint32_t i) { return session.requested[i]; });
      if (place < session.num_requested && found < session.num_requested)
        session.requested_by_panel[found++] = place;
    }
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
  const palpate::FloatingPointMode mode;  // a subnormal budget is none, here as where the config is checked
  pal_session_config complete;
  if (const pal_status status = palpate::read_config(pack, config, complete); status != PAL_STATUS_OK)
    return status;
  const size_t required = palpate::required_bytes(*pack, complete);
  if (arena_bytes < required) return PAL_STATUS_ARENA_TOO_SMALL;
  if (reinterpret_cast<uintptr_t>(arena) % palpate::Arena::kAlignment != 0)
    return PAL_STATUS_ARENA_MISALIGNED;
  if (complete.budget_seconds > 0 && complete.seconds_per_operation == 0)
    complete.seconds_per_operation = palpate::seconds_per_operation(complete.clock, complete.clock_user);
  // A session reads no clock; a recording of its config should not name one.
  complete.clock = nullptr;
  complete.clock_user = nullptr;
  memset(arena, 0, required);  // also touches every page now rather than in a frame
  palpate::Arena memory(arena);
  pal_session made = {};
  pal_session* place = palpate::carve_session(*pack, complete, memory, made);
  made.pack = pack;
  made.config = complete;
  made.kernel = palpate::choose_field_kernel();
  made.linear.making.inverse.kernel = palpate::choose_inverse_kernel();
  made.zone.kernel = palpate::choose_elimination_kernel();
  made.zone.is_bounded = complete.budget_seconds > 0;
  made.operations = palpate::operations_within(complete);
  for (uint32_t tool = 0; tool < complete.max_tools; ++tool) palpate::reset_tool(made.tools.tools[tool]);
  palpate::reset_passivity(made.tools.passivity);
  memcpy(static_cast<void*>(place), &made, sizeof made);
  *session = place;
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_session_set_fixed(pal_session* session, const uint32_t* contact_nodes,
                                            uint32_t count) noexcept {
  if (session == nullptr || (contact_nodes == nullptr && count > 0)) return PAL_STATUS_NULL_ARGUMENT;
  if (count > session->config.max_fixed) return PAL_STATUS_CAPACITY_EXCEEDED;
  for (uint32_t i = 0; i < count; ++i) {
    if (contact_nodes[i] >= session->pack->num_contact_nodes) return PAL_STATUS_NO_SUCH_NODE;
  }
  // The polynomials know nothing of nodes fixed later.
  const bool has_linear =
      session->pack->field_compliance != nullptr && !palpate::is_nonlinear_alone(session->config.model);
  if (count > session->zone.max_fixed && !has_linear) return PAL_STATUS_MODEL_CANNOT_ANSWER;
  session->used = true;
  palpate::record_fixed(*session, contact_nodes, count);
  // The field of the last frame keeps its weights: only the next frame knows of the change.
  bool changed = count != session->num_fixed;
  for (uint32_t i = 0; i < count; ++i) {
    changed = changed || session->fixed[i] != contact_nodes[i];
    session->fixed[i] = contact_nodes[i];
  }
  if (!changed) return PAL_STATUS_OK;
  session->num_fixed = count;
  ++session->fixed_version;
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
    if (const pal_status status = palpate::check_place(*session->pack, contact); status != PAL_STATUS_OK)
      return status;
    forces_given = forces_given || contact.force_axes != 0;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const bool by_force = (contact.force_axes >> axis & 1) != 0;
      if (!isfinite(by_force ? contact.force[axis] : contact.displacement[axis]))
        return PAL_STATUS_NOT_FINITE;
    }
  }
  if (!palpate::can_answer(*session, count, forces_given)) return PAL_STATUS_MODEL_CANNOT_ANSWER;
  session->used = true;
  // Memory of the session's tools, for who wants no results but records.
  if (results == nullptr) results = session->tools.results;
  palpate::Answering answering = palpate::answering_for(*session, contacts, count, forces_given);
  palpate::make_ready(*session, answering, contacts, count);
  // A zone may turn out to be none.
  answering = palpate::answering_for(*session, contacts, count, forces_given);
  palpate::make_ready(*session, answering, contacts, count);
  palpate::answer_contacts(*session, answering, contacts, count, session->turns, results);
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
  if (input.num_tools > session->config.max_tools) return PAL_STATUS_NO_SUCH_TOOL;
  if (input.poses == nullptr && input.num_tools > 0) return PAL_STATUS_NULL_ARGUMENT;
  if (results != nullptr && (input.result_bytes < palpate::kFirstResultBytes ||
                             input.result_bytes > palpate::kLargestStruct || input.result_bytes % 8 != 0))
    return PAL_STATUS_BAD_STRUCT_SIZE;
  const palpate::FloatingPointMode mode;
  session->used = true;
  session->by_contacts = false;
  palpate::answer_tools(*session, input, results);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_session_request_nodes(pal_session* session, const uint32_t* nodes,
                                                uint32_t count) noexcept {
  if (session == nullptr || (nodes == nullptr && count > 0)) return PAL_STATUS_NULL_ARGUMENT;
  if (count > session->config.max_requested) return PAL_STATUS_CAPACITY_EXCEEDED;
  for (uint32_t i = 0; i < count; ++i) {
    if (nodes[i] >= session->pack->num_nodes) return PAL_STATUS_NO_SUCH_NODE;
    if (i > 0 && nodes[i] <= nodes[i - 1]) return PAL_STATUS_BAD_ARGUMENT;
  }
  for (uint32_t i = 0; i < count; ++i) session->requested[i] = nodes[i];
  session->num_requested = count;
  if (palpate::is_compressed(*session->pack)) palpate::order_by_panel(*session);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_visual_frame(pal_session* session, pal_real* displacements,
                                       size_t stride_bytes) noexcept {
  if (session == nullptr || displacements == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (stride_bytes < 3 * sizeof(pal_real)) return PAL_STATUS_BAD_ARGUMENT;
  const palpate::FieldState& field = palpate::acquire(session->snapshots);
  const palpate::FloatingPointMode mode;
  char* out = reinterpret_cast<char*>(displacements);
  if (field.model == PAL_MODEL_LINEAR && palpate::is_compressed(*session->pack)) {
    palpate::write_fields_by_panel(*session, field, stride_bytes, out);
  } else {
    palpate::write_fields_in_order(*session, field, stride_bytes, out);
  }
  return PAL_STATUS_OK;
}
