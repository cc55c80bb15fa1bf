#include "runtime/src/force_output.hpp"

#include <math.h>

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

double fading(double left) {
  return left * left * (3.0 - 2.0 * left);
}

// Moves the last output toward `wanted` by at most max_force_rate.
bool limit_rate(double most, const Wrench& wanted, Wrench& out) {
  const double step[3] = {wanted.v[0] - out.v[0], wanted.v[1] - out.v[1], wanted.v[2] - out.v[2]};
  const double size = length_of(step);
  const bool limited = size > most;
  const double part = limited ? most / size : 1.0;
  for (int i = 0; i < 6; ++i) out.v[i] = limited ? out.v[i] + part * (wanted.v[i] - out.v[i]) : wanted.v[i];
  return limited;
}

}  // namespace

void reset_output(ForceOutput& output) {
  output = {};
  output.gain = 1.0;
  output.quiet = true;
}

uint32_t filter_force(const pal_session_config& config, const Wrench& model, bool switched, bool stale,
                      double dt, ForceOutput& output) {
  uint32_t flags = 0;
  if (switched) {
    for (int i = 0; i < 6; ++i) output.difference.v[i] = output.blended.v[i] - model.v[i];
    output.blend_left = config.blend_seconds;
  } else {
    output.blend_left = output.blend_left > dt ? output.blend_left - dt : 0.0;
  }
  Wrench wanted = model;
  if (output.blend_left > 0) {
    const double weight = fading(output.blend_left / config.blend_seconds);
    bool differs = false;
    for (int i = 0; i < 6; ++i) {
      wanted.v[i] += weight * output.difference.v[i];
      differs = differs || output.difference.v[i] != 0;
    }
    if (differs) flags |= PAL_FLAG_BLENDING;
  }
  output.blended = wanted;

  const double ramp = config.ramp_seconds > 0 ? dt / config.ramp_seconds : 1.0;
  if (stale) {
    output.gain = output.gain > ramp ? output.gain - ramp : 0.0;
  } else {
    output.gain = output.gain + ramp < 1.0 ? output.gain + ramp : 1.0;
  }
  if (stale || output.gain < 1.0) flags |= PAL_FLAG_STALE;

  double scale = output.gain;
  const double size = config.max_force > 0 ? scale * length_of(wanted.v) : 0.0;
  if (size > config.max_force) {
    scale *= config.max_force / size;
    flags |= PAL_FLAG_LIMITED;
  }
  for (double& component : wanted.v) component *= scale;
  if (config.max_force_rate > 0) {
    if (limit_rate(config.max_force_rate * dt, wanted, output.out)) flags |= PAL_FLAG_LIMITED;
  } else {
    output.out = wanted;
  }
  output.quiet =
      output.gain == 1.0 && output.blend_left == 0 && is_zero(output.blended) && is_zero(output.out);
  return flags;
}

}  // namespace palpate
