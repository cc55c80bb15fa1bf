#include "runtime/src/tools/passivity.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/numerics/pose.hpp"
#include "runtime/src/response/response.hpp"
#include "runtime/src/tools/tools.hpp"

namespace palpate {
namespace {

// passivity.hpp defines the account E, the stored energy W, `part` and s. A cycle may create this fraction of
// the larger of W and the largest E before the session reduces forces.
constexpr double kTolerance = 0.003;
// The gap of `part` to its target falls e-fold over max(kChange, min(1, E / W) / 2) W of the models' work.
// This lower limit keeps the apparent stiffness within the range that a device can render.
constexpr double kChange = 0.03;
// `part` snaps to 1 within this distance.
constexpr double kWhole = 1e-4;
// The tissue is at rest when W is below this fraction of the largest E.
constexpr double kRest = 1e-4;

double larger_of(double a, double b) {
  return a > b ? a : b;
}

double dot(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double work_of(const Motion& motion, const Wrench& wrench) {
  return dot(wrench.v, motion.translation) + dot(wrench.v + 3, motion.turn);
}

// The most work that the wrench could do along a motion of the same length.
double most_work_of(const Motion& motion, const Wrench& wrench) {
  return sqrt(dot(wrench.v, wrench.v) * dot(motion.translation, motion.translation)) +
         sqrt(dot(wrench.v + 3, wrench.v + 3) * dot(motion.turn, motion.turn));
}

// Multiplies a force or torque by `share`, and adds the component of the remainder that resists the motion.
// Does nothing without a motion.
void play_part(double share, const double motion[3], double force[3]) {
  const double along = dot(force, motion);
  const double square = dot(motion, motion);
  if (!(square > 0)) return;
  const double resisting = along > 0 ? along / square : 0.0;
  for (int i = 0; i < 3; ++i) force[i] = share * force[i] + (1.0 - share) * resisting * motion[i];
}

// Work of the last output forces along the motions of this frame.
double work_of_all(const ToolStates& states) {
  double work = 0;
  for (uint32_t t = 0; t < states.num_used; ++t)
    work += work_of(states.tools[t].motion, states.tools[t].output.out);
  return work;
}

bool is_zero(const double v[3]) {
  return v[0] == 0 && v[1] == 0 && v[2] == 0;
}

// Sets the motions of all tools in this frame.
void find_motions(ToolStates& states) {
  for (uint32_t t = 0; t < states.num_used; ++t) {
    ToolState& tool = states.tools[t];
    for (int i = 0; i < 3; ++i) tool.motion.translation[i] = tool.pose.position[i] - tool.before.position[i];
    turn_between(tool.before.orientation, tool.pose.orientation, tool.motion.turn);
    if (!is_zero(tool.motion.translation))
      memcpy(tool.last_motion.translation, tool.motion.translation, sizeof tool.motion.translation);
    if (!is_zero(tool.motion.turn)) memcpy(tool.last_motion.turn, tool.motion.turn, sizeof tool.motion.turn);
  }
}

// Whether every tool's output equals the model's force.
bool are_outputs_of_models(const ToolStates& states) {
  for (uint32_t t = 0; t < states.num_used; ++t) {
    if (!states.tools[t].output.is_model) return false;
  }
  return true;
}

// Whether any contact is out of equilibrium or has not reached its tool.
bool is_unsettled(const ToolStates& states) {
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    const uint32_t row = states.answered_index[c];
    if (row != kNotAnswered && (states.answered_results[row].flags & PAL_FLAG_UNCONVERGED) != 0) return true;
  }
  return false;
}

// Whether the answered set has contacts of uncounted strain. Counts a contact's strain once it has converged.
bool count_strained(ToolStates& states) {
  bool is_any_uncounted = false;
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    HeldContact& contact = states.contacts[c];
    const uint32_t row = states.answered_index[c];
    if (contact.strain != Strain::uncounted || row == kNotAnswered) continue;
    is_any_uncounted = true;
    if ((states.answered_results[row].flags & PAL_FLAG_UNCONVERGED) == 0) contact.strain = Strain::none;
  }
  return is_any_uncounted;
}

// Change of W in this frame, less the change by deliveries and `work` of the tools. Nonzero in two cases:
// - The answered set has contacts of uncounted strain (Strain in tools.hpp).
// - Gravity or an inclusion has changed W, and the response is the last frame's.
double brought_energy(const TissueState& tissue, ToolStates& states, double work) {
  const bool is_brought = !states.changed && tissue.energy_brought != 0;
  if (!count_strained(states) && !is_brought) return 0;
  const double grown = tissue.stored_energy - states.passivity.stored - states.energy_corrected;
  return isfinite(grown) ? grown - work : 0.0;
}

double tolerance(const Passivity& passivity) {
  // Out of equilibrium W may be many times its value at equilibrium, and E does not follow this W.
  const bool is_known = passivity.is_settled || passivity.stored < passivity.account;
  return kTolerance * larger_of(passivity.peak, is_known ? passivity.stored : passivity.account);
}

// Moves `part` towards 1 if E covers W or the tools move in (`work` > 0), else towards E / W. `account`: E.
// `larger`: the larger W of this frame and the last.
void update_part(double blend_seconds, bool is_covered, double account, double work, double larger,
                 ToolStates& states) {
  Passivity& passivity = states.passivity;
  if (is_covered && passivity.part == 1.0) return;
  const double ratio = is_covered ? 1.0 : account > 0 ? account / passivity.stored : 0.0;
  const double target = work > 0 ? 1.0 : ratio;
  const double whole_work = (0.5 * ratio > kChange ? 0.5 * ratio : kChange) * larger;
  const double pace = fabs(work) < whole_work ? fabs(work) / whole_work : 1.0;
  const double most = blend_seconds > 0 ? states.dt / blend_seconds : 1.0;
  const double change = pace * (target - passivity.part);
  passivity.part += change < most ? change : most;
  if (target == 1.0 && passivity.part > 1.0 - kWhole) passivity.part = 1.0;
}

}  // namespace

void reset_passivity(Passivity& passivity) {
  passivity = {};
  passivity.part = 1.0;
  passivity.is_settled = true;
}

void begin_account(const TissueState& tissue, ToolStates& states, const Wrench* models) {
  Passivity& passivity = states.passivity;
  const bool is_of_models = !states.changed && are_outputs_of_models(states);
  find_motions(states);
  if (states.num_contacts == 0 && is_of_models) {
    const double overdraft = passivity.account < 0 ? passivity.account : 0.0;
    const double peak = passivity.peak;
    reset_passivity(passivity);
    passivity.account = overdraft;
    passivity.peak = peak;
    return;
  }
  const double stored = tissue.stored_energy;
  const double larger = larger_of(stored, passivity.stored);
  const bool unsettled = is_unsettled(states);
  passivity.is_settled = !unsettled && !passivity.was_unsettled;
  passivity.was_unsettled = unsettled;
  const double work = work_of_all(states);
  double models_work = 0;
  for (uint32_t t = 0; t < states.num_used; ++t) models_work += work_of(states.tools[t].motion, models[t]);
  const double expected = is_of_models ? 0.5 * (work + models_work) : work;
  // A damaged pack may give energies that are not finite.
  if (!isfinite(stored) || !isfinite(expected) || !isfinite(models_work)) {
    passivity.work = 0;
    return;
  }
  passivity.account += brought_energy(tissue, states, expected);
  passivity.stored = stored;
  passivity.work = work;
  const double account = passivity.account + expected;
  const bool is_covered = account + tolerance(passivity) >= stored;
  update_part(tissue.config->blend_seconds, is_covered, account, models_work, larger, states);
}

double limit_energy(const ToolStates& states, Wrench* outputs) {
  const Passivity& passivity = states.passivity;
  double work = 0;
  double reach = 0;
  for (uint32_t t = 0; t < states.num_used; ++t) {
    work += work_of(states.tools[t].motion, outputs[t]);
    reach += most_work_of(states.tools[t].motion, outputs[t]);
  }
  const double available = passivity.account + 0.5 * passivity.work + tolerance(passivity);
  const bool is_covered = available + 0.5 * work >= passivity.stored;
  const double loss = is_covered && passivity.is_settled ? -work : 0.5 * (reach - work);
  if (available >= 0 && !(loss > available)) return 1.0;
  const double share = available > 0 ? available / loss : 0.0;
  for (uint32_t t = 0; t < states.num_used; ++t) {
    play_part(share, states.tools[t].last_motion.translation, outputs[t].v);
    play_part(share, states.tools[t].last_motion.turn, outputs[t].v + 3);
  }
  return share;
}

void end_account(ToolStates& states) {
  Passivity& passivity = states.passivity;
  const double step = 0.5 * (passivity.work + work_of_all(states));
  if (!isfinite(step)) return;
  passivity.account += step;
  // The energy of strained contacts out of equilibrium does not measure the work of the tools.
  const double most = passivity.is_settled ? passivity.account : passivity.peak + larger_of(0, step);
  passivity.peak = larger_of(passivity.peak, passivity.account < most ? passivity.account : most);
  if (!passivity.is_settled || passivity.stored > kRest * passivity.peak) return;
  passivity.part = 1.0;
  if (passivity.account > passivity.stored) passivity.account = passivity.stored;
}

}  // namespace palpate
