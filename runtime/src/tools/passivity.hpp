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
//    E += part (W - W_before)         one contact set in equilibrium answers, and tools feel its forces
//    E += sum of F . dx + T . dtheta  any other frame, by the trapezoidal rule, with F and T the output
//
// A delivery of the refining lane changes W where tools stand. The account keeps the work that tools have done.
//
// The session multiplies the models' forces by `part`. While E covers W, part = 1. Else `part` moves towards
//   E / W  while the tools move out, so that they end at E = 0,
//   1      while the tools move in, no faster than a blend.
// `part` moves with energy, not with time: a tool that stands still feels a constant force.
//
// Forces of contacts out of equilibrium are not the gradient of W and may grow on the way out. Then `part`
// drops at once, so that E covers the work of the models' forces F and T:
//    part sum of -(F . dx + T . dtheta) <= E + work / 2,   work that of the last frame's forces.
// Half of `work` is the reserve for the next frame, which may go as far.
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
  double stored;       // W of the last frame
  double part;         // factor on the models' forces
  double expected;     // gain of the account in this frame if forces stay unchanged
  double work;         // work of the last frame's forces in this frame
  bool one_set;        // the account uses W in this frame
  bool was_unsettled;  // some contact was out of equilibrium in the last frame
};

void reset_passivity(Passivity& passivity);

// Finds `part` for a frame whose contacts have answered with these forces of the models [num_used tools], and
// reduces blends that would create energy.
void begin_account(const TissueState& tissue, ToolStates& states, const Wrench* models);

// Adds the work of the output forces in this frame to the account.
void end_account(ToolStates& states);

}  // namespace palpate
