// The path of a tool's force from the model to the device, without jumps or runaway:
//
//    model's force, reduced for passivity (passivity.hpp)
//      -> hold an unreliable force -> blend over switches -> limits -> fade out -> force
//
// Blend: when the response changes at a time t0, the force continues from its last value,
//    F(t) = F_model(t) + w((t - t0) / T) (F(t0 - dt) - F_model(t0)),   w(0) = 1, w(1) = 0, w' = 0 at both.
// With s = (t - t0) / T, w is the cubic 1 - s^2 (3 - 2 s). A blend begins at its second frame, so each of
// several consecutive switches closes a part of the gap. The difference shrinks, by half or wholly, when the
// blend would create energy.
//
// Hold: when the model's force is unreliable, the last good force plays and fades out as for stale input. A
// blend leads back to the model's force.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

// A force and its torque in the world frame.
struct Wrench {
  double v[6];
};

struct ForceOutput {
  Wrench blended;     // last frame, before limits and fading
  Wrench difference;  // the difference that the blend fades out
  double blend_left;  // s
  double gain;        // 1; fades to 0 when the input is stale or the force is held
  bool held;          // the last frame held an unreliable force
  bool is_model;      // `out` equals the model's force
  double kept;        // factor on the difference in the next frame: below 1 if the difference drives the tool
  bool quiet;         // the output is zero, and stays zero for a zero force and fresh input
  Wrench limited;     // last frame, before fading
  Wrench out;         // last frame
};

void reset_output(ForceOutput& output);

// The force to play for the model's force. Returns PAL_FLAG_BLENDING, PAL_FLAG_STALE, PAL_FLAG_LIMITED,
// PAL_FLAG_NOT_FINITE, PAL_FLAG_HELD as they apply.
// - `reliable`: the model's force is good, if it is finite.
// - `switched`: the answering contacts or model have changed since the last frame.
// - `stale`: the input is too old.
uint32_t filter_force(const pal_session_config& config, const Wrench& model, bool reliable, bool switched,
                      bool stale, double dt, ForceOutput& output);

}  // namespace palpate
