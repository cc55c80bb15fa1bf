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

// Work of the wrench along the tool's motion since the last frame.
double work_of(const ToolState& tool, const Wrench& wrench) {
  double turn[3];
  turn_between(tool.before.orientation, tool.pose.orientation, turn);
  double work = 0;
  for (int i = 0; i < 3; ++i)
    work += wrench.v[i] * (tool.pose.position[i] - tool.before.position[i]) + wrench.v[3 + i] * turn[i];
  return work;
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

// Moves `part` towards covered / W. `work` is the work of the tools in this frame; `larger` is the larger W
// of this frame and the last.
void follow_stored(double blend_seconds, double covered, double work, double larger, ToolStates& states) {
  Passivity& passivity = states.passivity;
  const double stored = passivity.stored;
  if (covered >= stored && passivity.part == 1.0) return;
  const double ratio = covered >= stored ? 1.0 : covered > 0 ? covered / stored : 0.0;
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
  passivity.one_set = true;
}

void begin_account(const TissueState& tissue, ToolStates& states, const Wrench* models) {
  Passivity& passivity = states.passivity;
  const bool felt = feels_the_models(states);
  if (states.num_contacts == 0 && !states.changed && felt) {
    reset_passivity(passivity);
    return;
  }
  const double stored = tissue.stored_energy;
  const double larger = stored > passivity.stored ? stored : passivity.stored;
  const bool unsettled = is_unsettled(states);
  const bool is_or_was_unsettled = unsettled || passivity.was_unsettled;
  passivity.was_unsettled = unsettled;
  passivity.one_set = !states.changed && felt && !is_or_was_unsettled;
  // When the response changes, the account counts only the work of the tools.
  if (!states.changed) passivity.account += tissue.energy_brought;
  if (passivity.one_set) passivity.stored += tissue.energy_brought + states.energy_corrected;
  const double gained = passivity.one_set ? stored - passivity.stored : work_of_all(states);
  // The energy of contacts held under strain: the growth of the stored energy beyond the work of the tools.
  const double elsewhere = states.energy_corrected + (states.changed ? 0 : tissue.energy_brought);
  const double brought =
      takes_strained(states) && !passivity.one_set ? stored - passivity.stored - elsewhere - gained : 0.0;
  double of_models = 0;
  for (uint32_t t = 0; is_or_was_unsettled && t < states.num_used; ++t)
    of_models += work_of(states.tools[t], models[t]);
  // A damaged pack may give energies that are not finite.
  if (!isfinite(stored) || !isfinite(gained) || !isfinite(brought) || !isfinite(of_models)) {
    passivity.expected = passivity.work = 0;
    return;
  }
  passivity.account += brought;
  passivity.stored = stored;
  passivity.work = gained;
  passivity.expected = passivity.one_set         ? passivity.part * gained
                       : states.changed || !felt ? gained
                                                 : 0.5 * (gained + passivity.part * of_models);
  const double covered = passivity.account + passivity.expected + kTolerance * passivity.peak;
  // A blend may continue unchanged in the next frame: half of its gain stays in reserve.
  const double ahead = is_or_was_unsettled && gained < 0 ? covered + 0.5 * gained : covered;
  for (uint32_t t = 0; ahead < 0 && t < states.num_used; ++t) {
    if (work_of(states.tools[t]) >= 0) continue;
    const bool is_much = ahead < -kTolerance * passivity.peak;
    states.tools[t].output.kept = is_much ? 0.0 : 0.5;
    // A tool that leaves within the first half of a blend would feel the whole force for a frame.
    if (is_much && states.tools[t].output.blend_left > 0.5 * tissue.config->blend_seconds) passivity.part = 0;
  }
  follow_stored(tissue.config->blend_seconds, covered, is_or_was_unsettled ? of_models : gained, larger,
                states);
  const double left = passivity.account + 0.5 * gained + kTolerance * passivity.peak;
  if (of_models < 0 && -passivity.part * of_models > left) passivity.part = left > 0 ? -left / of_models : 0;
}

void end_account(ToolStates& states) {
  Passivity& passivity = states.passivity;
  double step = passivity.expected;
  if (!passivity.one_set) step = 0.5 * (passivity.work + work_of_all(states));
  if (!isfinite(step)) return;
  passivity.account += step;
  if (passivity.account > passivity.peak) passivity.peak = passivity.account;
  if (passivity.one_set && passivity.stored <= kRest * passivity.peak) {
    passivity.account = passivity.peak = passivity.stored;
    passivity.part = 1.0;
  }
}

}  // namespace palpate
