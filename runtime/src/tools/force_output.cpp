#include "runtime/src/tools/force_output.hpp"

#include <math.h>

#include <algorithm>

namespace palpate {
namespace {

double length_of(const double v[3]) {
  return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

bool is_zero(const Wrench& wrench) {
  for (const double component : wrench.v) {
    if (component != 0) return false;
  }
  return true;
}

// w of the blend: 1 - s^2 (3 - 2 s) = left^2 (3 - 2 left), left = 1 - s.
double fading(double left) {
  return left * left * (3.0 - 2.0 * left);
}

// x - x is 0 for a finite x, else NaN.
bool is_finite(const Wrench& wrench) {
  double zero = 0;
  for (const double component : wrench.v) zero += component - component;
  return zero == 0;
}

// The largest factor, at most 1, that brings a wrench within both a force limit and a torque limit.
double part_within(double most_force, double most_torque, const Wrench& wrench) {
  double part = 1.0;
  const double force = isfinite(most_force) ? length_of(wrench.v) : 0.0;
  const double torque = isfinite(most_torque) ? length_of(wrench.v + 3) : 0.0;
  if (force > most_force) part = most_force / force;
  if (torque * part > most_torque) part = most_torque / torque;
  return part;
}

// Limits `wanted`, and its step from `last` by the rates. Sets `last`. Returns whether a limit applied.
bool limit(const pal_session_config& config, double dt, Wrench& wanted, Wrench& last) {
  const double part = part_within(config.max_force, config.max_torque, wanted);
  if (part < 1.0) {
    for (double& component : wanted.v) component *= part;
  }
  const auto most = [&](double rate) { return isfinite(rate) ? rate * dt : rate; };
  Wrench step;
  for (int i = 0; i < 6; ++i) step.v[i] = wanted.v[i] - last.v[i];
  const double step_part = part_within(most(config.max_force_rate), most(config.max_torque_rate), step);
  if (step_part < 1.0) {
    for (int i = 0; i < 6; ++i) wanted.v[i] = last.v[i] + step_part * step.v[i];
  }
  last = wanted;
  return part < 1.0 || step_part < 1.0;
}

// Starts the output again from the faded force.
void take_gain(ForceOutput& output) {
  for (Wrench* wrench : {&output.blended, &output.limited}) {
    for (double& component : wrench->v) component *= output.gain;
  }
  output.gain = 1.0;
}

// Continues with the last limited force, without a blend.
void hold_last(ForceOutput& output) {
  output.blended = output.limited;
  output.difference = {};
  output.blend_left = 0;
}

}  // namespace

void reset_output(ForceOutput& output) {
  output = {};
  output.gain = 1.0;
  output.quiet = true;
  output.is_model = true;
}

uint32_t blend_force(const pal_session_config& config, bool reliable, bool switched, bool stale, double dt,
                     Wrench& wrench, ForceOutput& output) {
  const bool finite = is_finite(wrench);
  const bool held = !reliable || !finite;
  uint32_t flags = (held ? PAL_FLAG_HELD : 0) | (finite ? 0 : PAL_FLAG_NOT_FINITE);
  const bool released = output.held && !held;
  // Under stale input the gain keeps falling.
  if (released && !stale) take_gain(output);
  if (held && !output.held) hold_last(output);
  if (held) wrench = output.blended;
  output.held = held;
  if ((switched && !held) || released) {
    for (int i = 0; i < 6; ++i) output.difference.v[i] = output.blended.v[i] - wrench.v[i];
    output.blend_left = config.blend_seconds;
  }
  output.blend_left = output.blend_left > dt ? output.blend_left - dt : 0.0;
  if (output.blend_left > 0) {
    const double weight = fading(output.blend_left / config.blend_seconds);
    bool differs = false;
    for (int i = 0; i < 6; ++i) {
      wrench.v[i] += weight * output.difference.v[i];
      differs = differs || output.difference.v[i] != 0;
    }
    if (differs) {
      flags |= PAL_FLAG_BLENDING;
    } else {
      output.blend_left = 0;
    }
  }
  output.blended = wrench;
  return flags;
}

uint32_t limit_force(const pal_session_config& config, bool is_model, bool stale, double dt, Wrench wrench,
                     ForceOutput& output) {
  uint32_t flags = 0;
  const double ramp = config.ramp_seconds > 0 ? dt / config.ramp_seconds : 1.0;
  if (stale || output.held) {
    output.gain = output.gain > ramp ? output.gain - ramp : 0.0;
  } else {
    output.gain = output.gain + ramp < 1.0 ? output.gain + ramp : 1.0;
  }
  if (stale || (output.gain < 1.0 && !output.held)) flags |= PAL_FLAG_STALE;
  if (limit(config, dt, wrench, output.limited)) flags |= PAL_FLAG_LIMITED;
  for (int i = 0; i < 6; ++i) output.out.v[i] = output.gain * wrench.v[i];
  output.is_model = is_model && flags == 0;
  output.quiet =
      output.gain == 1.0 && output.blend_left == 0 && is_zero(output.blended) && is_zero(output.limited);
  return flags;
}

}  // namespace palpate
