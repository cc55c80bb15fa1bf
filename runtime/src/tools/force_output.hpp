// What becomes of a tool's force between the model and the device, so that the device neither kicks nor runs
// away:
//
//   model's force, reduced where it must be (passivity.hpp)
//     -> hold where it may have any value -> blend over switches -> limits -> fade out -> force
//
// Blend: when what answers changes at a time t0, the force goes on from where it was,
//   F(t) = F_model(t) + w((t - t0) / T) (F(t0 - dt) - F_model(t0)),   w(0) = 1, w(1) = 0, w' = 0 at both,
// which is continuous; w is the cubic 1 - t^2 (3 - 2 t). Where switches follow one another each of them
// closes a part of the gap: a blend begins at its second frame. A blend that gives a tool energy which nobody
// has put in is cut: by half in each such frame, or wholly where that is much.
//
// Hold: in place of a model's force that may have any value, the last good force is played, and fades out as for stale
// input. When the model's force is good again, a blend leads to it.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

// A force and its torque, world.
struct Wrench {
  double v[6];
};

struct ForceOutput {
  Wrench blended;     // of the last frame, before it was limited and faded
  Wrench difference;  // that is being faded out
  double blend_left;  // s
  double gain;        // 1; fades to 0 for a tool whose input is stale, or whose force is held
  bool held;          // the last frame had no good force of the model
  bool is_model;      // `out` is the model's force as it was given
  double kept;        // of the difference, in the next frame: 1, or less where it drives the tool
  bool quiet;         // nothing comes out, and nothing would for a force of zero and fresh input
  Wrench limited;     // of the last frame, before it was faded
  Wrench out;         // of the last frame
};

void reset_output(ForceOutput& output);

// The force to give out for the model's. `reliable`: the model's force is good, if it is finite. `switched`: the
// answering contacts or model have changed since the last frame. `stale`: the input is too old. Returns PAL_FLAG_BLENDING,
// PAL_FLAG_STALE, PAL_FLAG_LIMITED, PAL_FLAG_NOT_FINITE, PAL_FLAG_HELD as they apply.
uint32_t filter_force(const pal_session_config& config, const Wrench& model, bool reliable, bool switched,
                      bool stale, double dt, ForceOutput& output);

}  // namespace palpate
