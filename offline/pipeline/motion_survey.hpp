// Errors of nonlinear zones in motion, where the refining lane lags behind the contacts.
#pragma once

#include <functional>
#include <vector>

#include "offline/pipeline/measured_push.hpp"

namespace palpate {

struct Motion {
  double speed = 0;  // of the farthest contact: m/s
  int lag = 1;       // frames of 1 ms from a request for an iteration to the frame with the result
};

// Errors in the last frame of straight motions from rest, which reach a truth at full speed.
struct MotionErrors {
  Motion motion;
  size_t contacts = 1;  // largest number of contacts at a time
  int frames = 0;       // measured frames: one for each solved truth
  int flagged = 0;      // measured frames with a flag of PAL_FLAGS_UNRELIABLE
  ErrorFigures displacement;
  ErrorFigures force;
  // Largest second difference of a force in a frame with a new iteration, relative to |f_FE| floored as in
  // `force`. The difference adds the jump by the iteration and the curvature of the force along the path.
  double largest_jump = 0;
};

// Moves contacts to the displacements of each truth, with each motion. Zones are prepared before the contacts
// move. The result depends on neither threads nor clocks.
std::vector<MotionErrors> survey_motions(const OpenedPack& opened, const std::vector<ContactTruth>& truths,
                                         const std::vector<Motion>& motions, int jobs,
                                         const std::function<void(int, int)>& progress = {});

// Measures the lag of this machine: the frames of the longest of some iterations, and one for delivery.
int measure_lag(const OpenedPack& opened, const ContactTruth& truth);

}  // namespace palpate
