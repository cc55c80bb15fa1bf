// One simulation: its memory, and its two frames.
#include <string.h>

#include <math.h>

#include <palpate/palpate.h>

#include "runtime/src/arena.hpp"
#include "runtime/src/field_kernel.hpp"
#include "runtime/src/field_snapshot.hpp"
#include "runtime/src/flush_denormals.hpp"
#include "runtime/src/linear_dd.hpp"
#include "runtime/src/pack_view.hpp"
#include "runtime/src/polynomial_dd.hpp"
#include "runtime/src/sized_struct.hpp"

struct pal_session {
  const pal_pack* pack;
  pal_session_config config;
  palpate::AddColumns add_columns;
  uint32_t num_fixed;
  uint32_t* fixed;        // [max_fixed] contact nodes
  double* displacements;  // [max_contacts][3] model units
  double* forces;         // [max_contacts][3] model units
  uint32_t* input_flags;  // [max_contacts] what was done to the displacement before any model saw it
  palpate::LinearState linear;
  palpate::FieldSnapshots snapshots;
};

namespace palpate {
namespace {

constexpr uint32_t kMostFixed = 1024;
constexpr uint32_t kFirstConfigBytes = 16;
// In units of the scene's largest displacement: beyond it a float would overflow before anyone is told.
constexpr double kAbsurdDisplacement = 1e6;
// The estimate where nothing was measured: all of it may be wrong.
constexpr double kUnknownError = 1.0;

pal_session* carve_session(const pal_pack& pack, const pal_session_config& config, Arena& arena,
                           LinearState& linear, pal_session& arrays) {
  pal_session* session = arena.take<pal_session>(1);
  arrays.fixed = arena.take<uint32_t>(config.max_fixed);
  arrays.displacements = arena.take<double>(size_t{3} * config.max_contacts);
  arrays.forces = arena.take<double>(size_t{3} * config.max_contacts);
  arrays.input_flags = arena.take<uint32_t>(config.max_contacts);
  if (pack.contact_compliance != nullptr)
    carve_linear(pack, config.max_contacts, config.max_fixed, arena, linear);
  const size_t polynomial_weights = num_field_weights(pack);
  const size_t linear_weights = size_t{3} * linear.max_held;
  for (FieldState& slot : arrays.snapshots.slots) {
    slot.held = arena.take<uint32_t>(linear.max_held);
    slot.weights =
        arena.take<float>(linear_weights > polynomial_weights ? linear_weights : polynomial_weights);
  }
  reset_snapshots(arrays.snapshots);
  return session;
}

// `config` becomes the caller's, completed by the defaults.
pal_status read_config(const pal_pack* pack, const pal_session_config* given, pal_session_config& config) {
  if (pack == nullptr || given == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  config = pal_default_session_config(pack);
  if (const pal_status status = read_sized(*given, kFirstConfigBytes, config); status != PAL_STATUS_OK)
    return status;
  if (config.max_contacts < 1 || config.max_contacts > pack::kMostContacts || config.max_fixed > kMostFixed)
    return PAL_STATUS_BAD_ARGUMENT;
  int model;  // a C program may pass any integer, which it would be undefined to load as the enumeration
  static_assert(sizeof model == sizeof config.model);
  memcpy(&model, &config.model, sizeof model);
  switch (model) {
    case PAL_MODEL_AUTO:
      return PAL_STATUS_OK;
    case PAL_MODEL_LINEAR:
      return pack->contact_compliance != nullptr ? PAL_STATUS_OK : PAL_STATUS_NO_SUCH_MODEL;
    case PAL_MODEL_POLYNOMIAL:
      return pack->radii != nullptr ? PAL_STATUS_OK : PAL_STATUS_NO_SUCH_MODEL;
  }
  return PAL_STATUS_BAD_ARGUMENT;
}

size_t required_bytes(const pal_pack& pack, const pal_session_config& config) {
  Arena counting(nullptr);
  pal_session arrays = {};
  carve_session(pack, config, counting, arrays.linear, arrays);
  return counting.used();
}

// |d|, without overflow on the way.
double length(const double d[3]) {
  const double largest = fmax(fabs(d[0]), fmax(fabs(d[1]), fabs(d[2])));
  if (largest == 0) return 0;
  const double x = d[0] / largest;
  const double y = d[1] / largest;
  const double z = d[2] / largest;
  return largest * sqrt(x * x + y * y + z * z);
}

// Turns a contact's displacement into model units, shortening an absurd one.
uint32_t take_displacement(const pal_pack& pack, const double displacement[3], double out[3]) {
  const double largest = fmax(fabs(displacement[0]), fmax(fabs(displacement[1]), fabs(displacement[2])));
  // Near the largest double |d| itself overflows: half of such a displacement is shortened instead.
  const double half = largest > 1e300 ? 0.5 : 1.0;
  for (int i = 0; i < 3; ++i) out[i] = half * displacement[i];
  const double size = length(out);
  const double limit = kAbsurdDisplacement * pack.max_displacement * pack.metres;
  const double scale = size > limit ? limit / size : 1.0;
  for (int i = 0; i < 3; ++i) out[i] = scale * out[i] / pack.metres;
  return size > limit ? PAL_FLAG_CLAMPED | PAL_FLAG_EXTRAPOLATED : 0;
}

// p95 of the survey bin that holds |d|, or kUnknownError: for a case that no survey has, or a flagged answer.
void estimate_errors(const pal_pack& pack, pal_model model, bool surveyed, const double displacement[3],
                     pal_contact_result& result) {
  result.displacement_error = kUnknownError;
  result.force_error = kUnknownError;
  if (!surveyed || result.flags != 0) return;
  const SurveyView& survey = pack.surveys[model == PAL_MODEL_LINEAR ? 0 : 1];
  const double size = length(displacement) / pack.max_displacement;
  for (uint32_t bin = 0; bin < survey.num_bins; ++bin) {
    // The scene's largest displacement itself belongs to the last bin, whatever its rounding.
    if (size <= survey.bins[bin].to * (1.0 + 1e-9)) {
      result.displacement_error = survey.bins[bin].displacement_p95;
      result.force_error = survey.bins[bin].force_p95;
      return;
    }
  }
}

bool same_sites(const LinearState& linear, const pal_contact* contacts, uint32_t count) {
  if (!linear.valid || linear.num_contacts != count) return false;
  for (uint32_t c = 0; c < count; ++c) {
    if (linear.sites[c] != contacts[c].site) return false;
  }
  return true;
}

void answer_linear(pal_session& session, const pal_contact* contacts, uint32_t count,
                   pal_contact_result* results) {
  const pal_pack& pack = *session.pack;
  LinearState& linear = session.linear;
  if (!same_sites(linear, contacts, count)) {
    prepare_linear(pack, contacts, count, session.fixed, session.num_fixed, linear);
  }
  evaluate_linear(session.displacements, linear, session.forces);
  FieldState& field = session.snapshots.slots[session.snapshots.back];
  field.model = PAL_MODEL_LINEAR;
  field.num_held = linear.num_held;
  memcpy(field.held, linear.held, linear.num_held * sizeof *field.held);
  for (uint32_t i = 0; i < 3 * linear.num_held; ++i) {
    field.weights[i] = static_cast<float>(linear.nodal_force[i] * pack.metres);
  }
  if (results == nullptr) return;
  const bool surveyed = count == 1 && session.num_fixed == 0;
  for (uint32_t c = 0; c < count; ++c) {
    const double* d = session.displacements + size_t{3} * c;
    pal_contact_result& result = results[c];
    result = {};
    result.model = PAL_MODEL_LINEAR;
    result.flags = linear.flags | session.input_flags[c];
    if (session.config.model == PAL_MODEL_AUTO && pack.radii != nullptr)
      result.flags |= PAL_FLAG_LINEAR_FALLBACK;
    const double surveyed_to = pack.radii != nullptr ? pack.radii[contacts[c].site] : pack.max_displacement;
    if (length(d) > surveyed_to * (1.0 + 1e-9) || is_behind_surface(pack, contacts[c].site, d))
      result.flags |= PAL_FLAG_EXTRAPOLATED;
    estimate_errors(pack, PAL_MODEL_LINEAR, surveyed, d, result);
    for (uint32_t i = 0; i < 3; ++i) {
      result.force[i] = session.forces[3 * c + i] * pack.newtons;
      for (uint32_t j = 0; j < 3; ++j) {
        result.stiffness[i][j] =
            linear.stiffness[size_t{3 * c + i} * 3 * count + 3 * c + j] * (pack.newtons / pack.metres);
      }
    }
  }
}

void answer_polynomial(pal_session& session, const pal_contact& contact, pal_contact_result* results) {
  const pal_pack& pack = *session.pack;
  const double* d = session.displacements;
  FieldState& field = session.snapshots.slots[session.snapshots.back];
  field.model = PAL_MODEL_POLYNOMIAL;
  field.site = contact.site;
  PolynomialAnswer answer;
  evaluate_polynomial(pack, contact.site, d, pack.metres, answer, field.weights);
  if (results == nullptr) return;
  pal_contact_result& result = results[0];
  result = {};
  result.model = PAL_MODEL_POLYNOMIAL;
  result.flags = answer.flags | session.input_flags[0];
  estimate_errors(pack, PAL_MODEL_POLYNOMIAL, true, d, result);
  for (int i = 0; i < 3; ++i) {
    result.force[i] = answer.force[i] * pack.newtons;
    for (int j = 0; j < 3; ++j)
      result.stiffness[i][j] = answer.stiffness[3 * i + j] * (pack.newtons / pack.metres);
  }
}

}  // namespace
}  // namespace palpate

extern "C" pal_session_config pal_default_session_config(const pal_pack* pack) noexcept {
  pal_session_config config = {};
  config.struct_size = sizeof config;
  config.max_contacts = pack == nullptr ? 1 : pack->max_contacts;
  config.max_fixed = 0;
  config.model = PAL_MODEL_AUTO;
  return config;
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
  pal_session_config complete;
  if (const pal_status status = palpate::read_config(pack, config, complete); status != PAL_STATUS_OK)
    return status;
  const size_t required = palpate::required_bytes(*pack, complete);
  if (arena_bytes < required) return PAL_STATUS_ARENA_TOO_SMALL;
  if (reinterpret_cast<uintptr_t>(arena) % palpate::Arena::kAlignment != 0)
    return PAL_STATUS_ARENA_MISALIGNED;
  memset(arena, 0, required);  // also touches every page now rather than in a frame
  palpate::Arena memory(arena);
  pal_session made = {};
  pal_session* place = palpate::carve_session(*pack, complete, memory, made.linear, made);
  made.pack = pack;
  made.config = complete;
  made.add_columns = palpate::choose_add_columns();
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
  if (count > 0 &&
      (session->pack->contact_compliance == nullptr || session->config.model == PAL_MODEL_POLYNOMIAL)) {
    return PAL_STATUS_MODEL_CANNOT_ANSWER;
  }
  // The field of the last frame keeps its weights: only the next frame knows of the change.
  bool changed = count != session->num_fixed;
  for (uint32_t i = 0; i < count; ++i) {
    changed = changed || session->fixed[i] != contact_nodes[i];
    session->fixed[i] = contact_nodes[i];
  }
  if (!changed) return PAL_STATUS_OK;
  session->num_fixed = count;
  session->linear.valid = false;
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_haptic_frame(pal_session* session, const pal_contact* contacts, uint32_t count,
                                       pal_contact_result* results) noexcept {
  if (session == nullptr || (contacts == nullptr && count > 0)) return PAL_STATUS_NULL_ARGUMENT;
  const pal_pack& pack = *session->pack;
  if (count > session->config.max_contacts) return PAL_STATUS_CAPACITY_EXCEEDED;
  for (uint32_t c = 0; c < count; ++c) {
    if (contacts[c].site >= pack.num_sites) return PAL_STATUS_NO_SUCH_SITE;
    for (const double component : contacts[c].displacement) {
      if (!isfinite(component)) return PAL_STATUS_NOT_FINITE;
    }
  }
  if (count == 0) {
    session->snapshots.slots[session->snapshots.back].model = PAL_MODEL_AUTO;
    palpate::publish(session->snapshots);
    return PAL_STATUS_OK;
  }
  const bool polynomial = session->config.model != PAL_MODEL_LINEAR && pack.radii != nullptr && count == 1 &&
                          session->num_fixed == 0;
  if (!polynomial && (session->config.model == PAL_MODEL_POLYNOMIAL || pack.contact_compliance == nullptr)) {
    return PAL_STATUS_MODEL_CANNOT_ANSWER;
  }
  const palpate::FlushDenormals flush;
  for (uint32_t c = 0; c < count; ++c) {
    session->input_flags[c] =
        palpate::take_displacement(pack, contacts[c].displacement, session->displacements + size_t{3} * c);
  }
  if (polynomial) {
    palpate::answer_polynomial(*session, contacts[0], results);
  } else {
    palpate::answer_linear(*session, contacts, count, results);
  }
  palpate::publish(session->snapshots);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_visual_frame(pal_session* session, float* displacements,
                                       size_t stride_bytes) noexcept {
  if (session == nullptr || displacements == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (stride_bytes < 3 * sizeof(float)) return PAL_STATUS_BAD_ARGUMENT;
  const pal_pack& pack = *session->pack;
  const palpate::FieldState& field = palpate::acquire(session->snapshots);
  const palpate::FlushDenormals flush;
  char* out = reinterpret_cast<char*>(displacements);
  alignas(64) float panel[palpate::pack::kPanelRows];
  for (uint32_t p = 0; p < palpate::pack::num_panels(pack.num_nodes); ++p) {
    memset(panel, 0, sizeof panel);
    if (field.model == PAL_MODEL_LINEAR) {
      palpate::add_linear_field(pack, field, p, session->add_columns, panel);
    } else if (field.model == PAL_MODEL_POLYNOMIAL) {
      palpate::add_polynomial_field(pack, field, p, session->add_columns, panel);
    }
    const uint32_t first = p * palpate::pack::kPanelNodes;
    const uint32_t left = pack.num_nodes - first;
    const uint32_t nodes = left < palpate::pack::kPanelNodes ? left : palpate::pack::kPanelNodes;
    for (uint32_t i = 0; i < nodes; ++i, out += stride_bytes) memcpy(out, panel + 3 * i, 3 * sizeof(float));
  }
  return PAL_STATUS_OK;
}
