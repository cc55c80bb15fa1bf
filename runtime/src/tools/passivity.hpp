// Passivity: tools get no more energy out of the tissue than they have put in, whatever answers changes to on
// the way.
//
// The force of one model for one set of contacts is the gradient of an energy W, so a tool that comes back
// takes out what it put in. Another model, or another set, has another W for the same displacements: who goes
// in against the softer one and comes out along the stiffer one is given the difference. So does a blend
// whose rest pushes a tool along.
//
// The session keeps an account E of the work that all its tools have done since they last held nothing, or
// the tissue was last at rest:
//   E += part (W - W_before)         while one set answers, in balance, and tools feel its forces: exact where
//                                    frames are short
//   E += sum of F . dx + T . dtheta  by the trapezoidal rule over frames in which what answers changes,
//                                    blends, is limited or fades, and over those in which contacts have not
//                                    come to rest (PAL_FLAG_UNCONVERGED): F and T are what comes out
// The models' forces are multiplied by `part`, which is 1 until E no longer covers W. From then on it goes
// towards E / W while the tools are on their way out, so that they end at E = 0, and towards 1 while they are
// on their way in. It moves with the energy that comes or goes, not with time: tools that stand still feel a
// constant force, and one that turns round feels the other factor only after some way. Up it goes no
// faster than a blend does, for a fast tool brings all of that energy in a frame.
//
// The forces of contacts that have not come to rest, or not got to where their tools are, are no gradient of W along
// the tools' ways, and may rise many times on the way out. There `part` is cut at once to what E covers,
//   part sum of -(F . dx + T . dtheta) <= E + work / 2,   F and T the models', work that of the last frame's forces,
// but for the tolerance, which is twice what the frame takes by the rule above: the other half is for the next one,
// which may go as far.
//
// Source: the passivity observer and controller of Hannaford and Ryu 2002, with the energy known instead of
// observed where one model answers, and a factor on the force in place of a damper.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/tools/force_output.hpp"

namespace palpate {

struct TissueState;
struct ToolStates;

struct Passivity {
  double account;      // E: J, or the model's units of energy, as what follows
  double peak;         // the most that E was
  double stored;       // W of the last frame
  double part;         // of the models' forces
  double expected;     // of this frame: what the account gains if forces stay as they were
  double work;         // of this frame, by the forces of the last one
  bool one_set;        // this frame is booked by W
  bool was_unsettled;  // contacts, in the last frame
};

void reset_passivity(Passivity& passivity);

// Finds `part` for a frame whose contacts have been answered, with these forces of the models [num_used tools], and what
// of blends is cut.
void begin_account(const TissueState& tissue, ToolStates& states, const Wrench* models);

// Books the frame by what has come out.
void end_account(ToolStates& states);

}  // namespace palpate
