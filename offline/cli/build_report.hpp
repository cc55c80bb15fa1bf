// Prints a finished build, as text and as JSON, and the warnings that its user needs.
#pragma once

#include <filesystem>

#include "offline/pack/pack_writer.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/site_survey.hpp"
#include "offline/study/frame_timing.hpp"

namespace palpate {

struct BuildResult {
  const PackContent& content;  // the written content, with the surveys
  const std::vector<SiteResult>& sites;
  const SamplingPlan& plan;
  const OpenedPack& opened;
  std::filesystem::path pack;
  std::filesystem::path samples;  // empty: no samples were kept
  SolveCounts counts;             // sum over all processes
  int processes = 1;
  double seconds = 0;
  double sampling_seconds = 0;  // part of `seconds`: solves and fits of the sites
  SceneTiming scene_frame;
  double new_places_us = 0;  // median frame of contacts at new places between sites; 0: not applicable
  std::vector<LeftOutSite> left_out;  // sites that could not be sampled

  double frame_us() const { return scene_frame.frame.at(0.5) / 1000; }  // median, us
};

void print_json(const BuildResult& result);
void print_text(const BuildResult& result);
// Prints the warnings to standard error, each with a remedy.
void print_warnings(const BuildResult& result);

}  // namespace palpate
