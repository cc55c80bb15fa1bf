// Samples, fits and measures every site of a scene, on several threads.
#pragma once

#include <functional>
#include <vector>

#include "offline/precompute/error_survey.hpp"
#include "offline/precompute/polynomial_dd.hpp"

namespace palpate {

// What a basis may leave out, of the target.
inline constexpr double kBasisPart = 0.4;

// Of reduce_basis, and the degree of what it is given.
struct PolynomialSetting {
  int degree = 2;
  double basis_tolerance = 1e-3;
  bool rounded = false;
};

struct SamplingPlan {
  double target = 0.01;       // of displacement and force: samples are added to a site until its fit keeps it
  size_t least_samples = 10;  // nonlinear solves with their derivatives
  size_t most_samples = 60;
  bool fewest = false;     // sites are sampled: those where affine_site does not keep the target
  bool rounded = false;    // the columns of the field, to int16
  int survey_samples = 8;  // held-out solves a site, as many in each quarter of the range over all sites
  // Held-out solves of all sampled sites together, at the least, where `fewest` are sampled.
  int least_survey = 0;
  int survey_sets = 0;   // of several contacts (contact_sets.hpp)
  int survey_sites = 0;  // that are surveyed, spread over the organ; 0: all, as it must be for polynomials
  int jobs = 1;          // threads; the result does not depend on it
  // Further fits to each site's samples. Of degree 7 they take 14 samples or more.
  std::vector<PolynomialSetting> other_settings;
};

struct SiteResult {
  SitePolynomial polynomial;           // of degree 0 when none was asked for
  std::vector<SitePolynomial> others;  // of SamplingPlan::other_settings
  size_t samples = 0;                  // nonlinear solves that it took, fitted to or not; 0: affine_site
  // Of the fit, displacement, HeldOutError::all, but of degrees that were raised ::inside; 0 for the paper's, which
  // has none
  double held_out_error = 0;
  double held_out_force_error = 0;           // the same of the force
  PushOutcome cut_by = PushOutcome::solved;  // why the domain was shortened last, if it was
  double min_jacobian = 1;                   // smallest det F over the samples in the domain
  std::vector<SurveySample> survey;
  int unsolved = 0;  // of the survey
  SolveCounts counts;
};

// What a survey asks of the solver: a straight path from rest, in so many increments.
struct Push {
  size_t site = 0;
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
  int increments = 1;
};

// Whether it was cut, by more than rounding.
inline bool is_shortened(double reach, double max_displacement) {
  return reach < (1 - 1e-9) * max_displacement;
}

// The truth of each push, in their order, on `jobs` threads; the result does not depend on how many. Pushes
// without equilibrium come back unsolved. `progress` gets sites done, total, never from two threads at once.
// Throws std::runtime_error where the organ at rest has no stable answer to a push. Cost: two to four
// factorisations a push, and one a site.
std::vector<SurveySample> solve_pushes(const Assembly& assembly, const ContactSites& sites,
                                       const std::vector<Push>& pushes, int jobs,
                                       const std::function<void(int, int)>& progress = {},
                                       const RestState& rest = RestState());

// So many sites far from one another, ascending: from the first one on, each the farthest from those before.
std::vector<size_t> spread_sites(const Model& model, const ContactSites& sites, size_t count);

// Of sites with polynomials; the others are affine_site's.
size_t num_sampled(const std::vector<SiteResult>& results);

// The sum over all sites.
SolveCounts sum_of_counts(const std::vector<SiteResult>& results);

// `linear` serves the pinned linear part; where it is empty each site solves for its own. Sites that are not surveyed
// come back with nothing. Throws as SampledDomain::sample() does. `progress` gets sites done, total, never from two
// threads at once. What `store` has is not solved again; null: nothing is kept. `next` hands out the sites, as
// numbers among those that are surveyed, until it gives one beyond them, and is called from all threads at once;
// those that others get come back with nothing. Empty: all of them here, and SamplingPlan::least_survey is kept.
std::vector<SiteResult> sample_sites(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                                     const LinearDd& linear, const SamplingPlan& plan,
                                     const std::function<void(int, int)>& progress = {},
                                     const RestState& rest = RestState(), const SampleStore* store = nullptr,
                                     const std::function<size_t()>& next = {});

}  // namespace palpate
