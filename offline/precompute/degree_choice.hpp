// The degree of a site's polynomial, by its errors at samples that a fit was not given.
#pragma once

#include <limits>

#include "offline/precompute/polynomial_dd.hpp"

namespace palpate {

// A degree, and how wrong its fit is on samples that it was not given.
struct DegreeChoice {
  int degree = 1;
  double error = std::numeric_limits<double>::infinity();
  double force_error = error;
  double error_inside = error;  // HeldOutError::inside of the displacement

  // Where a tip crushes tissue against fixed nodes the force is the harder of the two.
  bool keeps(double target) const;
};

// Where so many solves do not keep the target by polynomials of the usual degrees, to 7, higher ones are tried, and of
// hard sites (site_survey.cpp) with fewer: a frame rather takes longer than a build.
inline constexpr size_t kUsualSamples = 60;

// The usual degree that does best. Errors fall with the degree until the samples no longer bear it, so that only the
// highest few come into question. Cost: three of held_out_error.
DegreeChoice choose_degree(const SiteSamples& samples);

// Higher ones, which take a frame longer, where they do better. Of their errors those inside count, for the reason that
// HeldOutError has. Cost: seven of held_out_error.
DegreeChoice raise_degree(const SiteSamples& samples, DegreeChoice best);

}  // namespace palpate
