// Errors of nonlinear zones in motion, where the refining lane lags behind the contacts.
#pragma once

#include <functional>
#include <vector>

#include "offline/pipeline/measured_push.hpp"

namespace palpate {

struct Motion {
  double speed = 0;  // of the farthest contact: m/s
  int lag = 1;       // frames of 1 ms from the request for an iteration to the frame that has its result
};

// Errors of the frames of a path, straight from rest and not slowing down, that have just reached their truth.
struct MotionErrors {
  Motion motion;
  size_t contacts = 1;  // at a time, at most
  int frames = 0;       // measured: one for each solved truth
  int flagged = 0;      // of these, frames with a flag of PAL_FLAGS_UNRELIABLE
  ErrorFigures displacement;
  ErrorFigures force;
  // Largest second difference of a force in a frame with a new iteration, relative to |f_FE| floored as in `force`. The
  // difference has two parts: the step that the iteration brings, and the curvature of the force along the path.
  double largest_jump = 0;
};

// Moves the pack's contacts to each truth's displacements, one motion after the other. Zones are prepared before the
// contacts move. The result depends on neither threads nor clocks.
std::vector<MotionErrors> survey_motions(const OpenedPack& opened, const std::vector<ContactTruth>& truths,
                                         const std::vector<Motion>& motions, int jobs,
                                         const std::function<void(int, int)>& progress = {});

// The lag of this machine: the frames that the longest of some iterations at a truth takes, and one to deliver it.
int measure_lag(const OpenedPack& opened, const ContactTruth& truth);

}  // namespace palpate
