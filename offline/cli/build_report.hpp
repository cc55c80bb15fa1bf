// What a build made: printed, as JSON, and what its user should know before using it.
#pragma once

#include <filesystem>

#include "offline/pack/pack_writer.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/site_survey.hpp"
#include "offline/study/frame_timing.hpp"

namespace palpate {

struct BuildResult {
  const PackContent& content;  // with its surveys
  const std::vector<SiteResult>& sites;
  const SamplingPlan& plan;
  const OpenedPack& opened;
  std::filesystem::path pack;
  std::filesystem::path samples;  // empty: none were kept
  SolveCounts counts;             // of all processes
  int processes = 1;
  double seconds = 0;
  double sampling_seconds = 0;  // of them, of the sites' solves and fits
  SceneTiming scene_frame;
  double new_places_us =
      0;  // of several contacts, all at new places between sites; 0 where that is no question

  double frame_us() const { return scene_frame.frame.at(0.5) / 1000; }  // median
};

void print_json(const BuildResult& result);
void print_text(const BuildResult& result);
// To standard error, each with a remedy.
void print_warnings(const BuildResult& result);

}  // namespace palpate
