// Estimates the time of a build from a few solves of its own sites.
#pragma once

#include "offline/precompute/site_survey.hpp"

namespace palpate {

// The work of a build that takes time.
struct PlannedWork {
  size_t sites = 0;             // sampled or surveyed
  size_t samples_per_site = 0;  // solves with derivatives; 0: without polynomials
  size_t survey_per_site = 0;   // solves of the survey
  size_t sets = 0;              // solved sets of several contacts
  bool has_series = false;      // Taylor coefficients at each site
  bool has_zones = false;       // zones that the survey brings to equilibrium
};

struct BuildTime {
  double push_seconds = 0;   // a push of a site by a typical part of max_displacement, solved from rest
  double build_seconds = 0;  // all of the work
};

// Returns processor seconds of one thread on an idle machine. Cost: a sample and a survey push at one site
// or, in half a second, at a few; on small organs up to five seconds more for whole sites, which tell how
// many are hard.
BuildTime estimate_build_time(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                              const RestState& rest, const SamplingPlan& plan, const PlannedWork& work);

}  // namespace palpate
