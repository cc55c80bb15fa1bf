#include "runtime/src/tools/passivity.hpp"

#include <math.h>

#include "runtime/src/numerics/pose.hpp"
#include "runtime/src/response/response.hpp"
#include "runtime/src/tools/tools.hpp"

namespace palpate {
namespace {

// The fraction of the peak energy that a cycle may create before the session reduces forces.
constexpr double kTolerance = 0.003;
// `part` completes its change while the larger of this fraction of W and half of E / W comes or goes. The
// limit keeps the apparent stiffness within the range that a device can render.
constexpr double kChange = 0.03;
// `part` snaps to 1 within this distance.
constexpr double kWhole = 1e-4;
// The tissue is at rest when its energy is below this fraction of the peak.
constexpr double kRest = 1e-4;

double larger_of(double a, double b) {
  return a > b ? a : b;
}

// Work of the wrench along the tool's motion since the last frame.
double work_of(const ToolState& tool, const Wrench& wrench) {
  double turn[3];
  turn_between(tool.before.orientation, tool.pose.orientation, turn);
  double work = 0;
  for (int i = 0; i < 3; ++i)
    work += wrench.v[i] * (tool.pose.position[i] - tool.before.position[i]) + wrench.v[3 + i] * turn[i];
  return work;
}

// The most that the wrench could do along a motion of the same length.
double most_work_of(const ToolState& tool, const Wrench& wrench) {
  double turn[3];
  turn_between(tool.before.orientation, tool.pose.orientation, turn);
  double force = 0, torque = 0, way = 0, angle = 0;
  for (int i = 0; i < 3; ++i) {
    const double moved = tool.pose.position[i] - tool.before.position[i];
    force += wrench.v[i] * wrench.v[i];
    torque += wrench.v[3 + i] * wrench.v[3 + i];
    way += moved * moved;
    angle += turn[i] * turn[i];
  }
  return sqrt(force * way) + sqrt(torque * angle);
}

// Work of the last output force along the same motion.
double work_of(const ToolState& tool) {
  return tool.output.quiet ? 0.0 : work_of(tool, tool.output.out);
}

double work_of_all(const ToolStates& states) {
  double work = 0;
  for (uint32_t t = 0; t < states.num_used; ++t) work += work_of(states.tools[t]);
  return work;
}

// Whether every tool's output equals the model's force.
bool feels_the_models(const ToolStates& states) {
  for (uint32_t t = 0; t < states.num_used; ++t) {
    if (!states.tools[t].output.is_model) return false;
  }
  return true;
}

// Whether any tool's output leads from another force to the model's. A limit on the model's force alone would reverse
// such an output.
bool is_blending(const ToolStates& states) {
  if (states.changed) return true;
  for (uint32_t t = 0; t < states.num_used; ++t) {
    if (states.tools[t].output.blend_left > 0) return true;
  }
  return false;
}

// Whether any contact is out of equilibrium or has not reached its tool.
bool is_unsettled(const ToolStates& states) {
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    const uint32_t row = states.answered_of[c];
    if (row != kNotAnswered && (states.answered_results[row].flags & PAL_FLAG_UNCONVERGED) != 0) return true;
  }
  return false;
}

// Whether a set answers contacts that were held under strain, until it has caught up with them.
bool takes_strained(ToolStates& states) {
  bool is_any_taken = false;
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    HeldContact& contact = states.contacts[c];
    const uint32_t row = states.answered_of[c];
    if (contact.strain != Strain::brought || row == kNotAnswered) continue;
    is_any_taken = true;
    if ((states.answered_results[row].flags & PAL_FLAG_UNCONVERGED) == 0) contact.strain = Strain::none;
  }
  return is_any_taken;
}

// Moves `part` towards E / W, or towards 1 where E covers W. `account` is E; `work` is the work of the tools in this
// frame; `larger` is the larger W of this frame and the last.
void follow_stored(double blend_seconds, bool is_covered, double account, double work, double larger,
                   ToolStates& states) {
  Passivity& passivity = states.passivity;
  if (is_covered && passivity.part == 1.0) return;
  const double ratio = is_covered ? 1.0 : account > 0 ? account / passivity.stored : 0.0;
  const double target = work > 0 ? 1.0 : ratio;
  const double whole = (0.5 * ratio > kChange ? 0.5 * ratio : kChange) * larger;
  const double pace = fabs(work) < whole ? fabs(work) / whole : 1.0;
  const double most = blend_seconds > 0 ? states.dt / blend_seconds : 1.0;
  const double change = pace * (target - passivity.part);
  passivity.part += change < most ? change : most;
  if (target == 1.0 && passivity.part > 1.0 - kWhole) passivity.part = 1.0;
}

}  // namespace

void reset_passivity(Passivity& passivity) {
  passivity = {};
  passivity.part = 1.0;
  passivity.by_energy = passivity.is_settled = true;
}

void begin_account(const TissueState& tissue, ToolStates& states, const Wrench* models) {
  Passivity& passivity = states.passivity;
  const bool felt = !states.changed && feels_the_models(states);
  if (states.num_contacts == 0 && felt) {
    reset_passivity(passivity);
    return;
  }
  const double stored = tissue.stored_energy;
  const double larger = larger_of(stored, passivity.stored);
  const bool unsettled = is_unsettled(states);
  passivity.is_settled = !unsettled && !passivity.was_unsettled;
  passivity.was_unsettled = unsettled;
  const double work = work_of_all(states);
  double of_models = 0;
  double reach = 0;
  for (uint32_t t = 0; t < states.num_used; ++t) {
    of_models += work_of(states.tools[t], models[t]);
    reach += most_work_of(states.tools[t], models[t]);
  }
  // When the response changes, the account counts only the work of the tools.
  const double elsewhere = states.changed ? 0 : tissue.energy_brought;
  const double by_tools = stored - passivity.stored - elsewhere - states.energy_corrected;
  passivity.by_energy = felt && passivity.is_settled && passivity.part == 1.0;
  double expected = work;
  if (passivity.by_energy) {
    expected = by_tools;
  } else if (felt) {
    expected = 0.5 * (work + passivity.part * of_models);
  }
  // Contacts held under strain bring the growth of the stored energy beyond the work of the tools.
  const double brought = takes_strained(states) && !passivity.by_energy ? by_tools - work : 0.0;
  // A damaged pack may give energies that are not finite.
  if (!isfinite(stored) || !isfinite(expected) || !isfinite(brought) || !isfinite(of_models)) {
    passivity.expected = passivity.work = 0;
    return;
  }
  passivity.account += elsewhere + brought;
  passivity.stored = stored;
  passivity.work = work;
  passivity.expected = expected;
  const double tolerated = kTolerance * passivity.peak;
  const double covered = passivity.account + expected + tolerated;
  // A blend may continue unchanged in the next frame: half of its gain stays in reserve.
  const double ahead = passivity.is_settled || work > 0 ? covered : covered + 0.5 * work;
  for (uint32_t t = 0; ahead < 0 && t < states.num_used; ++t) {
    if (work_of(states.tools[t]) >= 0) continue;
    const bool is_much = ahead < -tolerated;
    states.tools[t].output.kept = is_much ? 0.0 : 0.5;
    // A tool that leaves within the first half of a blend would feel the whole force for a frame.
    if (is_much && states.tools[t].output.blend_left > 0.5 * tissue.config->blend_seconds) passivity.part = 0;
  }
  const bool is_covered = covered >= stored;
  follow_stored(tissue.config->blend_seconds, is_covered, covered - tolerated, of_models, larger, states);
  const bool needs_reserve = !is_covered && !is_blending(states);
  if (passivity.is_settled && !needs_reserve) return;
  const double loss = needs_reserve ? 0.5 * (reach - of_models) : -of_models;
  const double left = larger_of(
      0, passivity.account - passivity.floor + 0.5 * work + kTolerance * larger_of(passivity.peak, stored));
  if (passivity.part * loss > left) passivity.part = left / loss;
}

void end_account(ToolStates& states) {
  Passivity& passivity = states.passivity;
  const bool by_energy = passivity.by_energy && passivity.part == 1.0;
  const double step = by_energy ? passivity.expected : 0.5 * (passivity.work + work_of_all(states));
  if (!isfinite(step)) return;
  passivity.account += step;
  passivity.peak = larger_of(passivity.peak, passivity.account);
  const double scale = larger_of(passivity.peak, passivity.stored);
  if (passivity.account < passivity.floor - kTolerance * scale) passivity.floor = passivity.account;
  if (passivity.is_settled && passivity.stored <= kRest * passivity.peak) {
    passivity.account = passivity.peak = passivity.stored;
    passivity.floor = 0;
    passivity.part = 1.0;
  }
}

}  // namespace palpate
