#include "offline/precompute/degree_choice.hpp"

#include <algorithm>
#include <cmath>

#include "offline/precompute/sample_points.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

constexpr int kUsualDegree = 7;

// Whether all samples but one (leave-one-out) give at least 1.2 equations for each term.
bool is_overdetermined(const SiteSamples& samples, int degree) {
  constexpr double kEquationsPerTerm = 1.2;
  return kEquationsPerSample * static_cast<double>(samples.samples.size() - 1) >=
         kEquationsPerTerm * pack::num_monomials(2, static_cast<uint32_t>(degree));
}

}  // namespace

bool DegreeChoice::keeps(double target) const {
  return std::max(error, force_error) <= target;
}

DegreeChoice choose_degree(const SiteSamples& samples) {
  constexpr int kTried = 3;
  DegreeChoice best;
  int tried = 0;
  for (int degree = kUsualDegree; degree > 1 && tried < kTried; --degree) {
    if (!is_overdetermined(samples, degree)) continue;
    const HeldOutError error = held_out_error(samples, degree);
    if (error.all < best.error) best = {degree, error.all, error.all, error.inside};
    if (std::isfinite(error.all)) ++tried;
  }
  if (best.degree > 1) best.force_error = held_out_force_error(samples, best.degree).all;
  return best;
}

DegreeChoice raise_degree(const SiteSamples& samples, DegreeChoice best) {
  for (int degree = kUsualDegree + 1;
       degree <= highest_fit_degree(samples.half) && is_overdetermined(samples, degree); ++degree) {
    const HeldOutError error = held_out_error(samples, degree);
    if (error.inside < best.error_inside)
      best = {degree, error.inside, held_out_force_error(samples, degree).inside, error.inside};
  }
  return best;
}

}  // namespace palpate
