// Passivity: tools take no more energy out of the tissue than they put in, whatever response answers.
//
// The force of one model for one contact set is the gradient of an energy W, so a closed path returns its
// work. Energy may appear in two ways:
// - Another model or contact set has another W at the same displacements. A tool that goes in against a softer
//   response and comes out along a stiffer response gains the difference.
// - The fading difference of a blend may drive a tool.
//
// The session keeps an account E of the tools' work since the tissue was last at rest or the tools held
// nothing:
//    E += W - W_before                contacts in equilibrium, whose forces the tools feel whole
//    E += sum of F . dx + T . dtheta  any other frame, by the trapezoidal rule, with F and T the output
//
// A delivery of the refining lane changes W where tools stand. The account keeps the work that tools have done.
//
// The session multiplies the models' forces by `part`. While E covers W, part = 1. Else `part` moves towards
//   E / W  while the tools move out, so that they end at E = 0,
//   1      while the tools move in, no faster than a blend.
// `part` moves with energy, not with time: a tool that stands still feels a constant force.
//
// Two kinds of forces may give more: forces of contacts out of equilibrium are not the gradient of W, and forces that E
// does not cover return more than was put in. Both are limited at once. With `work` and w the work of the last frame's
// and of the models' forces along this frame's motion, and r = sum of |F| |dx| + |T| |dtheta|:
//    part (-w)              <= E - E_0 + work / 2   E covers W: the next frame may go as far
//    part (r - w) / 2       <= E - E_0 + work / 2   else, outside blends: the next frame may go in any direction
// E_0 is the overdraft that a jump has left: no force of the frame after a jump can undo the work of the force before.
//
// Source: the passivity observer and controller of Hannaford and Ryu 2002. Here the model gives the energy
// where one model answers, and a factor on the force replaces the damper.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/tools/force_output.hpp"

namespace palpate {

struct TissueState;
struct ToolStates;

struct Passivity {
  double account;      // E: J, or the model's units of energy, as all energies below
  double peak;         // the largest E so far
  double floor;        // E_0, at most 0
  double stored;       // W of the last frame
  double part;         // factor on the models' forces
  double expected;     // gain of the account in this frame if forces stay unchanged
  double work;         // work of the last frame's forces in this frame
  bool by_energy;      // the account follows W in this frame
  bool is_settled;     // all contacts were in equilibrium in this frame and the last
  bool was_unsettled;  // some contact was out of equilibrium in the last frame
};

void reset_passivity(Passivity& passivity);

// Finds `part` for a frame whose contacts have answered with these forces of the models [num_used tools], and
// reduces blends that would create energy.
void begin_account(const TissueState& tissue, ToolStates& states, const Wrench* models);

// Adds the work of the output forces in this frame to the account.
void end_account(ToolStates& states);

}  // namespace palpate
