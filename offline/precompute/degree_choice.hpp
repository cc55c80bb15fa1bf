// Chooses the degree of a site's polynomial by its errors at left-out samples.
#pragma once

#include <limits>

#include "offline/precompute/polynomial_dd.hpp"

namespace palpate {

// A degree with its leave-one-out errors.
struct DegreeChoice {
  int degree = 1;
  double error = std::numeric_limits<double>::infinity();
  double force_error = error;
  double error_inside = error;  // HeldOutError::inside of the displacement

  // Whether displacement and force keep the target. Near fixed nodes the force has the larger error.
  bool keeps(double target) const;
};

// From this number of solves on a fit also tries degrees above 7: a longer frame is preferred to a longer
// build. Hard sites (site_survey.cpp) try these degrees earlier.
inline constexpr size_t kUsualSamples = 60;

// Returns the best degree of at most 7. Errors fall with the degree until the samples no longer suffice, so
// only the three highest degrees are tested. Cost: three calls of held_out_error.
DegreeChoice choose_degree(const SiteSamples& samples);

// Tries degrees above 7, which lengthen frames, by HeldOutError::inside. Cost: seven calls of held_out_error.
DegreeChoice raise_degree(const SiteSamples& samples, DegreeChoice best);

}  // namespace palpate
