// Plans a build before its first solve: models, sites, solves, precision, time.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "offline/fem/assembly.hpp"
#include "offline/pack/input_files.hpp"
#include "offline/precompute/contact_sets.hpp"
#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/nonlinear_zone.hpp"
#include "offline/precompute/scene.hpp"
#include "offline/precompute/site_survey.hpp"

namespace palpate {

// Whether the pack has the compliance of linear_dd: on the scene's request, or because contacts that the scene requires zones
// for are answered by linear_dd until their zones are prepared.
bool has_compliance(const Scene& scene);

// Whether the pack compresses the compliance: on the scene's request, because only zones need it, or because the dense matrix
// is too large.
bool is_to_be_compressed(const Scene& scene, const ContactSites& sites);

// Whether sampling uses the dense compliance of all sites. Otherwise each site solves for its own columns.
bool is_dense_at_hand(const Scene& scene, const ContactSites& sites);

// Plans the nodes and elements of the nonlinear zones. Returns no zones where the scene:
//   1. excludes zones, or
//   2. leaves the choice open and has single contacts only, linear materials, or no budget for zones.
std::optional<ZoneTables> plan_zone(const Model& model, const Scene& scene, const ContactSites& sites);

// Plans sites, solves and precision. Throws std::runtime_error "FILE: REASON; REMEDY" where nothing remains to fit.
SamplingPlan plan_sampling(const Scene& scene, const ContactSites& sites, int jobs);

// The same without held-out solves: errors stay unknown. Throws std::runtime_error for a scene with polynomials.
SamplingPlan plan_without_survey(const Scene& scene, const ContactSites& sites, int jobs);

// Lists the sites that are sampled or surveyed.
size_t num_worked(const SamplingPlan& plan, const ContactSites& sites);

// Draws the sets of several contacts for the survey. All of them are held-out data: no model fits contact sets.
std::vector<ContactSet> surveyed_sets(const Model& model, const Scene& scene, const ContactSites& sites,
                                      const SamplingPlan& plan);

// Hashes all inputs that change a digit of sample_sites() at a site, this program included. The site's label is not
// part of the key: the label names the site's file. Targets, degrees and precisions do not change a solve.
std::string what_samples_depend_on(const Model& model, const Scene& scene, const ContactSites& sites,
                                   const std::vector<InputFile>& inputs);

// Estimates the bytes of the kept samples.
double sample_store_bytes(const Model& model, const Scene& scene, const ContactSites& sites,
                          const SamplingPlan& plan);

// Prints organ, scene and estimated time to standard output. `keeps_samples`: samples stay on disk.
void print_plan(const Model& model, const Scene& scene, const ContactSites& sites, const Assembly& assembly,
                const std::vector<InputFile>& inputs, const SamplingPlan& plan, int processes,
                bool keeps_samples);

}  // namespace palpate
