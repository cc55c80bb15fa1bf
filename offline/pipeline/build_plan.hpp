// What a build is about to do: before any of it is done.
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

// Whether the compliance is to be packed compressed: as the scene says, or because dense it is too large.
bool is_to_be_compressed(const Scene& scene, const ContactSites& sites);

// Whether it is to be at hand in full while sites are sampled; else each site solves for its own.
bool is_dense_at_hand(const Scene& scene, const ContactSites& sites);

// Nodes and elements of the nonlinear zones that the pack is to carry, their compliance left empty; none where the
// scene does not want them, or leaves it open and has one contact at a time, no nonlinear material, or no budget for
// them. Throws std::runtime_error where it wants them and linear_dd is not dense.
std::optional<ZoneTables> plan_zone(const Model& model, const Scene& scene, const ContactSites& sites);

// Sites, solves and precision. Throws std::runtime_error "FILE: REASON; REMEDY" where the scene leaves nothing to fit.
SamplingPlan plan_sampling(const Scene& scene, const ContactSites& sites, int jobs);

// Sites that are sampled or surveyed.
size_t num_worked(const SamplingPlan& plan, const ContactSites& sites);

// The sets of several contacts that are surveyed: held out, as nothing is fitted to such.
std::vector<ContactSet> surveyed_sets(const Model& model, const Scene& scene, const ContactSites& sites,
                                      const SamplingPlan& plan);

// All that changes a digit of what sample_sites solves at a site, whose label names its file: this program among it.
// Targets, degrees and precisions do not.
std::string what_samples_depend_on(const Model& model, const Scene& scene, const ContactSites& sites,
                                   const std::vector<InputFile>& inputs);

// Of them, about.
double sample_store_bytes(const Model& model, const Scene& scene, const ContactSites& sites,
                          const SamplingPlan& plan);

// Organ, scene, and about how long it takes, to standard output. `keeps_samples`: on disk.
void print_plan(const Model& model, const Scene& scene, const ContactSites& sites, const Assembly& assembly,
                const std::vector<InputFile>& inputs, const SamplingPlan& plan, int processes,
                bool keeps_samples);

}  // namespace palpate
