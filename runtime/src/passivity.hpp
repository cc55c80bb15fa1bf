// Passivity: tools get no more energy out of the tissue than they have put in, whatever answers changes to on
// the way.
//
// The force of one model for one set of contacts is the gradient of an energy W, so a tool that comes back
// takes out what it put in. Another model, or another set, has another W for the same displacements: who goes
// in against the softer one and comes out along the stiffer one is given the difference. So does a blend
// whose rest pushes a tool along.
//
// The session keeps an account E of the work that the tools have done since they last held nothing:
//   E += part (W - W_before)       while one set answers (exact: no rule of quadrature)
//   E += sum of F . dx + T . dt    over frames in which it changes or a blend goes on, F and T as last given out
// The models' forces are multiplied by `part`: 1 while E covers W. Where it does not, because of a switch,
// part goes towards E / W on the way out, which then ends at E = 0, and back towards 1 on the way in, which
// adds what is missing. It moves with the energy and not with time, so that the force stays a function of
// where the tool is: a tremor changes nothing.
//
// Source: the passivity observer and controller of Hannaford and Ryu 2002, with the energy known instead of
// observed where one model answers, and a factor on the force in place of a damper.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

struct Passivity {
  double account;  // E: J, or the model's units of energy, as what follows
  double peak;     // the most that E was
  double stored;   // W of the last frame
  double part;
};

void reset_passivity(Passivity& passivity);

// Takes a frame into the account once its contacts are answered. Ends blends that would overdraw it. Returns
// whether forces are reduced.
bool keep_account(pal_session& session);

}  // namespace palpate
