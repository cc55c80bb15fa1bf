// The stages of a build between the solves and the bytes, each with its progress bar: `build` and `report` make packs
// of them.
#pragma once

#include <optional>
#include <vector>

#include "offline/pack/pack_writer.hpp"

namespace palpate {

// linear_dd as it is to be packed: one of them, or neither.
struct Compliance {
  LinearDd dense;
  std::optional<CompressedCompliance> compressed;
};

Compliance compute_compliance(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                              const RestState& rest, int jobs);

// Compliance and exterior of planned zones.
void compute_zone(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                  const RestState& rest, int jobs, ZoneTables& zone);

// What a pack is to carry of these stages, as its scene asks for; they outlive it.
PackContent content_of(const Model& model, const Scene& scene, const ContactSites& sites,
                       const RestState& rest, const SamplingPlan& plan, const Compliance& compliance,
                       const std::vector<SiteResult>& results, const std::optional<ZoneTables>& zone,
                       std::vector<InputFile> inputs);

// The truths of surveyed_sets(), with a progress bar; `next` as solve_drawn_sets() has it.
SolvedSets solve_surveyed_sets(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                               const RestState& rest, const SamplingPlan& plan, const SampleStore* store,
                               const std::function<size_t()>& next = {});

// The bytes of a pack that is complete but for its surveys and what its compressed compliance is worth: both are
// measured here, by the real runtime on `jobs` threads, and put into `content` and `compliance`.
AlignedBytes write_surveyed_pack(const Assembly& assembly, const RestState& rest,
                                 const std::vector<SiteResult>& results, const SolvedSets& sets, int jobs,
                                 Compliance& compliance, PackContent& content);

// As `palpate build` makes it, but that models come from the scene alone. `store`: what it has is not solved again;
// null: nothing is kept.
AlignedBytes make_pack(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                       const RestState& rest, const SamplingPlan& plan, const SampleStore* store,
                       std::vector<InputFile> inputs);

}  // namespace palpate
