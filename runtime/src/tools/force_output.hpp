// The path of a tool's force from the model to the device, without jumps or runaway:
//
//    model's force, reduced for passivity (passivity.hpp)
//      -> hold an unreliable force -> blend over switches -> leave the energy account enough (passivity.hpp)
//      -> limits -> fade out -> force
//
// Blend: when the response changes at a time t0, the force continues from its last value,
//    F(t) = F_model(t) + w((t - t0) / T) (F(t0 - dt) - F_model(t0)),   w(0) = 1, w(1) = 0, w' = 0 at both.
// With s = (t - t0) / T, w is the cubic 1 - s^2 (3 - 2 s). A blend begins at its second frame, so each of
// several consecutive switches closes a part of the gap.
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
  Wrench blended;     // force of the last frame, before limits and fading
  Wrench difference;  // F(t0 - dt) - F_model(t0), which the blend fades out
  double blend_left;  // remaining time of the blend: s
  double gain;        // 1; fades to 0 when the input is stale or the force is held
  bool held;          // the last frame held an unreliable force
  bool is_model;      // `out` equals the model's force
  bool quiet;         // the output is zero, and stays zero for a zero force and fresh input
  Wrench limited;     // force of the last frame, before fading
  Wrench out;         // force of the last frame, as played
};

void reset_output(ForceOutput& output);

// Holds and blends the model's force. Returns PAL_FLAG_BLENDING, PAL_FLAG_NOT_FINITE and PAL_FLAG_HELD.
// - `reliable`: the model's force is good, if it is finite.
// - `switched`: the answering contacts or model have changed since the last frame.
// - `stale`: the input is too old.
uint32_t blend_force(const pal_session_config& config, bool reliable, bool switched, bool stale, double dt,
                     Wrench& wrench, ForceOutput& output);

// Limits and fades a blended force into ForceOutput::out. Returns PAL_FLAG_STALE and PAL_FLAG_LIMITED.
// `is_model`: nothing has changed the model's force so far.
uint32_t limit_force(const pal_session_config& config, bool is_model, bool stale, double dt, Wrench wrench,
                     ForceOutput& output);

}  // namespace palpate
