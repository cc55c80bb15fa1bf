// Passivity: tools take no more energy out of the tissue than they put in, whatever response answers.
//
// The force of one model for one contact set is the gradient of an energy W, so a closed path returns its
// work. Energy may appear in two ways:
// - Another model or contact set has another W at the same displacements. A tool that goes in against a soft
//   response and comes out along a stiffer response gains the difference.
// - The fading difference of a blend may drive a tool.
//
// The session keeps an account E of the work of its tools. The trapezoidal rule sums the work of the forces F
// and torques T that were played:
//    E += sum of (F + F_before) / 2 . dx + (T + T_before) / 2 . dtheta
// Changes of W by gravity, by inclusions and by holds of strained tissue count as work of the tools.
//
// 1. The session multiplies the models' forces by `part`, which tends to 1 while E covers W, and else to
//      E / W  while the tools move out, so that they end at E = 0,
//      1      while the tools move in, no faster than a blend.
//    `part` moves with energy, not with time: a tool that stands still feels a constant force.
// 2. The output F, after blends, must leave enough in the account for a next step as long as this frame's dx.
//    Otherwise the session plays a part s of F, and the remainder's component that resists the motion:
//      F_played = s F + (1 - s) max(0, F . dx) dx / |dx|^2
//      s l = E + work_before / 2 + tolerance,    l = (r - w) / 2,   r = sum of |F| |dx|,   w = sum of F . dx
//    with work_before the work of the last frame's forces along dx. Torques count as forces.
//    - F adds w / 2 to E in this frame, and takes at most r / 2 in the next frame. Hence l.
//    - The second term gives at most as much in the next step as it takes in this step. So the tools pay back
//      an overdraft as they move.
//    - In an overdraft s = 0. Only F_played, not r or w, uses the last motion of a tool that stands still.
//    - While contacts are in equilibrium and E covers W, forces are gradients of W, and l = -w is enough.
//
// A tool that suddenly moves much farther than in the last frame may overdraw the account. The tools pay an
// overdraft back. The account drops a surplus once the tissue is at rest or no contact is held.
//
// Source: passivity observer and controller, Hannaford and Ryu 2002. Factors on the force replace the damper.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/tools/force_output.hpp"

namespace palpate {

struct TissueState;
struct ToolStates;

// A tool's motion from one frame to the next, world frame.
struct Motion {
  double translation[3];  // m
  double turn[3];         // rotation (turn_between())
};

struct Passivity {
  double account;      // E: J, or the model's units of energy, as all energies below
  double peak;         // the largest E of the session
  double stored;       // W of the last frame; from begin_account() on, of this frame
  double part;         // factor on the models' forces
  double work;         // work of the last frame's forces in this frame
  bool is_settled;     // all contacts were in equilibrium in this frame and the last
  bool was_unsettled;  // some contact was out of equilibrium in the last frame
};

void reset_passivity(Passivity& passivity);

// Updates E and `part` for a frame. `models` [num_used]: the models' forces of the tools on the tissue.
void begin_account(const TissueState& tissue, ToolStates& states, const Wrench* models);

// Multiplies the forces `outputs` [num_used] of this frame by s as in 2, and returns s.
double limit_energy(const ToolStates& states, Wrench* outputs);

// Adds the work of the output forces in this frame to the account.
void end_account(ToolStates& states);

}  // namespace palpate
