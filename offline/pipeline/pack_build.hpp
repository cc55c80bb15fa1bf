// Builds a pack from a scene: solves, fits, zones, survey by the real runtime, bytes.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "offline/pack/pack_writer.hpp"
#include "offline/pipeline/build_plan.hpp"
#include "offline/pipeline/ranks.hpp"

namespace palpate {

// linear_dd in its packed form: dense, compressed, or absent.
struct Compliance {
  LinearDd dense;
  std::optional<CompressedCompliance> compressed;
};

// A built pack with all intermediate results. Not movable: `content` refers to the other members.
struct PackBuild {
  ContactSites sites;  // the sites of the pack
  Compliance compliance;
  std::vector<SiteResult> results;    // one for each site
  std::vector<LeftOutSite> left_out;  // sites that could not be sampled
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

// The inputs of a build. The build keeps references to them.
struct BuildInputs {
  const Assembly& assembly;
  const Scene& scene;
  const ContactSites& sites;
  const RestState& rest;
  const SamplingPlan& plan;
  const SampleStore* store = nullptr;  // supplies and keeps solves; null: no solve is kept
};

// Builds the pack. `input_files`: files that the pack carries. `ranks`: processes that share the solves;
// null: one process. Leaves out sites that cannot be sampled; throws std::runtime_error where none is left.
// Returns null on every rank but the first.
std::unique_ptr<PackBuild> build_pack(const BuildInputs& from, std::vector<InputFile> input_files,
                                      Ranks* ranks = nullptr);

}  // namespace palpate
