// A scene becomes a pack: solves, fits, zones, survey by the real runtime, bytes. Each stage shows its progress.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "offline/pack/pack_writer.hpp"
#include "offline/pipeline/build_plan.hpp"
#include "offline/pipeline/ranks.hpp"

namespace palpate {

// linear_dd as it is to be packed: one of them, or neither.
struct Compliance {
  LinearDd dense;
  std::optional<CompressedCompliance> compressed;
};

// Compliance and exterior of planned zones.
void compute_zone(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                  const RestState& rest, int jobs, ZoneTables& zone);

// A pack and all that it was made from. Not movable: `content` refers to the other members.
struct PackBuild {
  Compliance compliance;
  std::vector<SiteResult> results;  // by site
  SolvedSets sets;
  std::optional<ZoneTables> zone;
  std::optional<PackContent> content;
  std::optional<AlignedBytes> bytes;
  SolveCounts counts;
  double sampling_seconds = 0;

  PackBuild() = default;
  PackBuild(const PackBuild&) = delete;
  PackBuild& operator=(const PackBuild&) = delete;
};

// Everything that a build needs to know. The build refers to it while it lives.
struct BuildInputs {
  const Assembly& assembly;
  const Scene& scene;
  const ContactSites& sites;
  const RestState& rest;
  const SamplingPlan& plan;
  const SampleStore* store = nullptr;  // solves found here are not repeated; null: no solve is kept
};

// Makes the pack. `inputs`: the files that it carries. `ranks`: processes that share the solves; null: this one alone.
// Returns null on every rank but the first.
std::unique_ptr<PackBuild> build_pack(const BuildInputs& from, std::vector<InputFile> inputs,
                                      Ranks* ranks = nullptr);

}  // namespace palpate
