// The effort of a report: numbers of pushes and sites, and time limits of its measurements.
#pragma once

#include <cstddef>

namespace palpate {

struct ReportEffort {
  int random_pushes = 512;    // pushes for the validation and the error distributions
  int most_sites = 12;        // sites of the comparison of methods
  int pushes_at_level = 144;  // pushes for each |d|
  int several = 32;           // pushes of several contacts for each |d|
  size_t timed_sets = 4;      // sets of sites in the timing of a method
  int timed_rounds = 5;       // rounds for each method
  double seconds = 0.6;       // warm frames of a method at one |d|
  int most_frames = 100000;   // limit of warm frames
  int cold_frames = 60;
  int newton_frames = 12;  // frames of full Newton
  int scene_sites = 24;    // limit for a scene that is packed for the report
  int scene_sets = 0;      // contact sets of the scene's survey; 0: as the build plans

  // Returns the effort of a first look. Its few pushes give a weaker validation.
  static ReportEffort quick() {
    ReportEffort effort;
    effort.random_pushes = 24;
    effort.most_sites = 3;
    effort.pushes_at_level = 12;
    effort.several = 2;
    effort.timed_sets = 1;
    effort.timed_rounds = 2;
    effort.seconds = 0.06;
    effort.most_frames = 10000;
    effort.cold_frames = 4;
    effort.newton_frames = 3;
    effort.scene_sites = 4;
    effort.scene_sets = 4;
    return effort;
  }
};

}  // namespace palpate
