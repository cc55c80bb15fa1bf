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

  // Checks displacement and force: where a tip crushes tissue against fixed nodes, the force has the larger error.
  bool keeps(double target) const;
};

// From this number of solves on, degrees above 7 are tried; hard sites (site_survey.cpp) try them earlier. A
// longer frame is preferred to a longer build.
inline constexpr size_t kUsualSamples = 60;

// Returns the best usual degree. Errors fall with the degree until the samples no longer suffice, so only the
// highest few degrees are tested. Cost: three calls of held_out_error.
DegreeChoice choose_degree(const SiteSamples& samples);

// Tries higher degrees, which lengthen frames. Compares errors inside of the domain (see HeldOutError). Cost:
// seven calls of held_out_error.
DegreeChoice raise_degree(const SiteSamples& samples, DegreeChoice best);

}  // namespace palpate
