// Plans a build before its first solve: models, sites, solves, precision, time.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "offline/fem/assembly.hpp"
#include "offline/pack/input_files.hpp"
#include "offline/pipeline/build_time.hpp"
#include "offline/precompute/contact_sets.hpp"
#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/nonlinear_zone.hpp"
#include "offline/precompute/rest_state.hpp"
#include "offline/precompute/scene.hpp"
#include "offline/precompute/site_survey.hpp"

namespace palpate {

// Whether the pack has the compliance of linear_dd, which answers contacts before zones are prepared.
bool has_compliance(const Scene& scene);

// Whether the pack compresses the compliance: on request, for zones alone, or for a large dense matrix.
bool is_to_be_compressed(const Scene& scene, const ContactSites& sites);

// Returns the tolerance of a compressed compliance: looser where the linear model only bridges the time to a zone.
double compliance_tolerance(const Scene& scene);

// Whether sampling uses the dense compliance of all sites. Otherwise each site solves for its response.
bool is_dense_at_hand(const Scene& scene, const ContactSites& sites);

// Plans the nodes and elements of the nonlinear zones. Returns no zones where the scene:
//   1. excludes zones, or
//   2. leaves the choice open and has single contacts only, linear materials, or no budget for zones.
std::optional<ZoneTables> plan_zone(const Model& model, const Scene& scene, const ContactSites& sites);

// Plans sites, solves and precision. Throws std::runtime_error where max_displacement is too small to fit.
SamplingPlan plan_sampling(const Scene& scene, const ContactSites& sites, int jobs);

// Plans without held-out solves: errors stay unknown. Throws std::runtime_error for a scene with polynomials.
SamplingPlan plan_without_survey(const Scene& scene, const ContactSites& sites, int jobs);

// Returns the number of sites that are sampled or surveyed.
size_t num_worked(const SamplingPlan& plan, const ContactSites& sites);

// Draws the sets of several contacts for the survey. All sets are held-out data: no model fits contact sets.
std::vector<ContactSet> surveyed_sets(const Model& model, const Scene& scene, const ContactSites& sites,
                                      const SamplingPlan& plan);

// Returns a key of all inputs that change a digit of a site's solves, this program included. The key omits
// the label of the site, which names the file, and targets, degrees and precisions, which change no solve.
std::string what_samples_depend_on(const Model& model, const Scene& scene, const ContactSites& sites,
                                   const std::vector<InputFile>& inputs);

// Estimates the bytes of the kept samples.
double sample_store_bytes(const Model& model, const Scene& scene, const ContactSites& sites,
                          const SamplingPlan& plan);

// Estimates the bytes of a pack without its inputs and zones.
double planned_bytes(const Scene& scene, const ContactSites& sites, const SamplingPlan& plan);

// Returns the work of a build, for estimate_build_time().
PlannedWork planned_work(const Model& model, const Scene& scene, const ContactSites& sites,
                         const SamplingPlan& plan, bool has_zones);

// Prints organ, scene and estimated time. `processes`: ranks of the build. `keeps_samples`: on disk.
void print_plan(const Scene& scene, const ContactSites& sites, const Assembly& assembly,
                const RestState& rest, const std::vector<InputFile>& inputs, const SamplingPlan& plan,
                int processes, bool keeps_samples);

}  // namespace palpate
