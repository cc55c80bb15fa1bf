#include "runtime/src/passivity.hpp"

#include <math.h>

#include "runtime/src/response.hpp"
#include "runtime/src/session_state.hpp"

namespace palpate {
namespace {

// Of the peak: the energy that a cycle may create; more than the account is wrong by over frames with a
// blend.
constexpr double kTolerance = 0.003;
// `part` goes most of its way while this part of W comes or goes.
constexpr double kChange = 0.03;
// Nearer to 1 it is 1.
constexpr double kWhole = 1e-4;

// The turn from one unit quaternion to another as a vector, for turns of a frame: twice the vector part of
// now * conjugate(before).
void turn_between(const double before[4], const double now[4], double out[3]) {
  const double w = now[0] * before[0] + now[1] * before[1] + now[2] * before[2] + now[3] * before[3];
  const double scale = w < 0 ? -2.0 : 2.0;
  for (int i = 0; i < 3; ++i) {
    const int j = 1 + (i + 1) % 3;
    const int k = 1 + (i + 2) % 3;
    out[i] =
        scale * (before[0] * now[1 + i] - now[0] * before[1 + i] - now[j] * before[k] + now[k] * before[j]);
  }
}

// What the forces last given out to the tools did on their way to where they are now.
double work_of(const ToolStates& states) {
  double work = 0;
  for (uint32_t t = 0; t < states.num_tools; ++t) {
    const ToolState& tool = states.tools[t];
    if (tool.output.quiet) continue;
    const double* wrench = tool.output.blended.v;
    double turn[3];
    turn_between(tool.before.orientation, tool.pose.orientation, turn);
    for (int i = 0; i < 3; ++i)
      work += wrench[i] * (tool.pose.position[i] - tool.before.position[i]) + wrench[3 + i] * turn[i];
  }
  return work;
}

bool is_blending(const ToolStates& states) {
  for (uint32_t t = 0; t < states.num_tools; ++t) {
    if (states.tools[t].output.blend_left > 0) return true;
  }
  return false;
}

// What contacts that were taken hold of under strain bring with them: the energy that goes where they alone go
// back to rest, sum f . d - sum d . K d / 2 over them as for linear forces. All of it, if there are no others.
double strain_brought(pal_session& session) {
  ToolStates& states = session.tools;
  const auto brings = [&](uint32_t c) {
    return states.contacts[c].strain == Strain::brought && states.answered_of[c] != kNotAnswered;
  };
  double brought = 0;
  uint32_t num_bringing = 0;
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    if (!brings(c)) continue;
    ++num_bringing;
    const uint32_t row = states.answered_of[c];
    const double* d = states.inputs[c].displacement;
    for (int i = 0; i < 3; ++i) brought += states.answered_results[row].force[i] * d[i];
    for (uint32_t other = 0; other < states.num_contacts; ++other) {
      if (!brings(other)) continue;
      double stiffness[9] = {};
      add_coupling(session, states.answered, states.answered_results, row, states.answered_of[other],
                   stiffness);
      const double* e = states.inputs[other].displacement;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) brought -= 0.5 * d[i] * stiffness[3 * i + j] * e[j];
      }
    }
  }
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    if (brings(c)) states.contacts[c].strain = Strain::none;
  }
  return num_bringing > 0 && num_bringing == states.num_answered ? session.stored_energy : brought;
}

}  // namespace

void reset_passivity(Passivity& passivity) {
  passivity = {};
  passivity.part = 1.0;
}

bool keep_account(pal_session& session) {
  ToolStates& states = session.tools;
  Passivity& passivity = states.passivity;
  const bool blending = is_blending(states);
  if (states.num_contacts == 0 && !states.changed && !blending) {
    reset_passivity(passivity);
    return false;
  }
  const double stored = states.num_answered > 0 ? session.stored_energy : 0.0;
  const double larger = stored > passivity.stored ? stored : passivity.stored;
  const bool one_set = !states.changed && !blending;
  // By the tools' motion alone: not by what answers it.
  const double gained = one_set ? stored - passivity.stored : work_of(states);
  const double step = one_set ? passivity.part * gained : gained + strain_brought(session);
  if (!isfinite(stored) || !isfinite(step)) return passivity.part < 1.0;  // of a damaged pack
  passivity.stored = stored;
  passivity.account += step;
  if (passivity.account > passivity.peak) passivity.peak = passivity.account;
  const double covered = passivity.account + kTolerance * passivity.peak;
  if (covered < 0) {
    for (uint32_t t = 0; t < states.num_tools; ++t) states.tools[t].output.blend_left = 0;
  }
  if (covered >= stored && passivity.part == 1.0) return false;
  const double ratio = covered >= stored ? 1.0 : covered > 0 ? covered / stored : 0.0;
  const double target = gained > 0 ? 1.0 : ratio;
  const double whole = kChange * larger;  // what moves it all the way
  const double pace = fabs(gained) < whole ? fabs(gained) / whole : 1.0;
  passivity.part += pace * (target - passivity.part);
  if (target == 1.0 && passivity.part > 1.0 - kWhole) passivity.part = 1.0;
  return passivity.part < 1.0;
}

}  // namespace palpate
