// Samples, fits and surveys the sites of a scene, on several threads. A survey is a set of held-out solves.
#pragma once

#include <functional>
#include <vector>

#include "offline/precompute/error_survey.hpp"
#include "offline/precompute/polynomial_dd.hpp"

namespace palpate {

// The basis may leave out this fraction of the target.
inline constexpr double kBasisPart = 0.4;

struct SamplingPlan {
  double target =
      0.01;  // relative error of displacement and force: a site is sampled until its fit keeps the target
  size_t least_samples = 10;  // nonlinear solves with derivatives
  size_t most_samples = 60;
  bool fewest = false;   // sample only sites where affine_site misses the target
  bool rounded = false;  // round the field's columns to int16
  // held-out solves for each site, equally many in each quarter of the range over all sites
  int survey_samples = 8;
  // With `fewest`: least total of held-out solves over the sampled sites.
  int least_survey = 0;
  int survey_sets = 0;   // surveyed sets of several contacts (contact_sets.hpp)
  int survey_sites = 0;  // surveyed sites, spread over the organ; 0: all, required with polynomials
  int jobs = 1;          // threads; the result does not depend on the number
};

struct SiteResult {
  SitePolynomial polynomial;  // degree 0 without polynomials
  size_t samples = 0;         // nonlinear solves, fitted or not; 0: affine_site
  // HeldOutError of the displacement: `all`, or `inside` for degrees above 7; 0 for the paper's fits.
  double held_out_error = 0;
  double held_out_force_error = 0;           // the same for the force
  PushOutcome cut_by = PushOutcome::solved;  // reason of the last cut of the domain
  double min_jacobian = 1;                   // smallest det F over the domain's samples
  double out_of_reach = 0;  // above 0: DomainTooSmall ended this site at this |d|; there is no polynomial
  std::vector<SurveySample> survey;
  int unsolved = 0;  // pushes of the survey without an equilibrium
  SolveCounts counts;
};

// A solve of a survey: a straight path from rest in `increments` increments.
struct Push {
  size_t site = 0;
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
  int increments = 1;
};

// Whether a reach (length unit) of the domain is shorter than max_displacement by more than rounding.
inline bool is_shortened(double reach, double max_displacement) {
  return reach < (1 - 1e-9) * max_displacement;
}

// Solves all pushes on `jobs` threads; the result, in the order of `pushes`, does not depend on threads.
// Pushes without equilibrium return unsolved. `progress` gets done and total sites, from one thread at a
// time. Throws std::runtime_error where rest has no stable response. Cost: 2 to 4 factors a push, one a site.
std::vector<SurveySample> solve_pushes(const Assembly& assembly, const ContactSites& sites,
                                       const std::vector<Push>& pushes, int jobs,
                                       const std::function<void(int, int)>& progress = {},
                                       const RestState& rest = RestState());

// Returns `count` distant sites, ascending: the first, then repeatedly the site farthest from all chosen.
std::vector<size_t> spread_sites(const Model& model, const ContactSites& sites, size_t count);

// Returns the number of sites with fitted polynomials; affine_site serves the other sites.
size_t num_sampled(const std::vector<SiteResult>& results);

// Returns the sum of the counts of all sites.
SolveCounts sum_of_counts(const std::vector<SiteResult>& results);

// Samples, fits and surveys the sites of the plan; other sites return empty. `linear` (may be empty) gives
// the linear parts; else each site solves for its own. `store` (null: none) supplies and keeps solves. `next`
// returns indices among the sites of the plan, then a larger number; all threads call `next`. Sites of other
// processes return empty. An empty `next` means all sites, and SamplingPlan::least_survey applies. `progress`
// gets done and total sites, from one thread at a time. A site with too small a domain ends no other site.
std::vector<SiteResult> sample_sites(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                                     const LinearDd& linear, const SamplingPlan& plan,
                                     const std::function<void(int, int)>& progress = {},
                                     const RestState& rest = RestState(), const SampleStore* store = nullptr,
                                     const std::function<size_t()>& next = {});

}  // namespace palpate
