// Passivity: tools take no more energy out of the tissue than they put in, whatever response answers.
//
// The force of one model for one contact set is the gradient of an energy W, so a closed path returns its
// work. Energy may appear in two ways:
// - Another model or contact set has another W at the same displacements. A tool that goes in against a softer
//   response and comes out along a stiffer response gains the difference.
// - The fading difference of a blend may drive a tool.
//
// The session keeps an account E of the work of its tools as a device sees it, by the trapezoidal rule over the forces F
// and torques T that were played:
//    E += sum of (F + F_before) / 2 . dx + (T + T_before) / 2 . dtheta
// What gravity, inclusions and strained tissue at the begin of a hold bring to W counts as work of the tools.
//
// 1. The session multiplies the models' forces by `part`. While E covers W, part = 1. Else `part` moves towards
//      E / W  while the tools move out, so that they end at E = 0,
//      1      while the tools move in, no faster than a blend.
//    `part` moves with energy, not with time: a tool that stands still feels a constant force.
// 2. The output F, after blends, must leave the account enough for the next frame, whose step dx may be as long as that of
//    this frame. Where it does not, the session plays a part s of F, and the component of the remainder that resists the
//    motion:
//      F_played = s F + (1 - s) max(0, F . dx) dx / |dx|^2
//      s l = E + work_before / 2 + tolerance,    l = (r - w) / 2,   r = sum of |F| |dx|,   w = sum of F . dx
//    with work_before the work of the last frame's forces along dx. Torques count as forces.
//    - The second term cannot give in the next step more than it has taken in this one. So the tools pay an overdraft back
//      as they move.
//    - In an overdraft s = 0, and a tool that stands still has the dx of its last motion.
//    - While contacts are in equilibrium and E covers W, forces are those of W, and l = -w is enough.
//
// No force can undo the work of the force before: a tool that suddenly goes much farther than in the last frame may
// overdraw the account. The account keeps that overdraft until it is paid back; a surplus is lost where the tissue is at rest
// or nothing is held.
//
// Source: the passivity observer and controller of Hannaford and Ryu 2002. Here factors on the force replace the damper.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/tools/force_output.hpp"

namespace palpate {

struct TissueState;
struct ToolStates;

// A tool's motion from one frame to the next.
struct Motion {
  double way[3];
  double turn[3];
};

struct Passivity {
  double account;      // E: J, or the model's units of energy, as all energies below
  double peak;         // the largest E of the session
  double stored;       // W of the last frame
  double part;         // factor on the models' forces
  double work;         // work of the last frame's forces in this frame
  bool is_settled;     // all contacts were in equilibrium in this frame and the last
  bool was_unsettled;  // some contact was out of equilibrium in the last frame
};

void reset_passivity(Passivity& passivity);

// Finds `part` for a frame whose contacts have answered with these forces of the models [num_used tools].
void begin_account(const TissueState& tissue, ToolStates& states, const Wrench* models);

// Limits the outputs of this frame [num_used tools], before limits and fading, and returns s.
double limit_energy(const ToolStates& states, Wrench* outputs);

// Adds the work of the output forces in this frame to the account.
void end_account(ToolStates& states);

}  // namespace palpate
