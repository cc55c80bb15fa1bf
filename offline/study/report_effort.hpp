// How much a report measures: enough in half an hour on two cores, or a glance in two minutes.
#pragma once

#include <cstddef>
#include <vector>

namespace palpate {

struct ReportEffort {
  int random_pushes = 512;           // that a pack is judged by, and its distributions of errors are of
  int most_sites = 12;               // at which methods are compared,
  int pushes_at_level = 144;         // by so many pushes of each |d|;
  int pushes_of_slow_methods = 24;   //   of thick zones that move or are not carried
  int several = 32;                  // pushes of several contacts, of each |d|,
  int several_of_slow_methods = 12;  //   of thick zones, the first so many
  int most_zone_rings = 4;           // of a method that the pack does not carry
  std::vector<int> zone_iterations = {1, 2, 3, 4, 5};            // of a frame of a zone that moves,
  int most_moving_rings = 4;                                     // with at most so many rings
  int most_moving_rings_of_several = 2;                          //   and so many where several contacts move
  std::vector<double> cg_tolerances = {1e-1, 1e-2, 1e-3, 1e-4};  // of localised conjugate gradients
  bool every_setting = true;                                     // of polynomials, else a few
  bool packs_of_fewer_rings = true;                              // for several contacts
  size_t timed_sets = 4;             // of sites, at which a method's frames are timed,
  int timed_rounds = 5;              //   each method so often
  double seconds = 0.6;              // of the warm frames of a method at one |d|,
  double seconds_of_settings = 0.2;  //   of one that the pack does not carry,
  int most_frames = 100000;          //   or so many of them
  int cold_frames = 60;
  int cold_frames_of_settings = 12;
  int reference_frames = 120;  // of linear references,
  int newton_frames = 12;      // and of full Newton
  int scene_sites = 24;        // of a scene that is packed for the report, at most;
  int scene_survey = 0;        // pushes of its survey; 0: as many as `palpate build` takes
  int scene_sets = 0;          // and sets of several contacts

  // A glance: surveys and judgements of so few pushes hold less surely than those of a whole report.
  static ReportEffort quick() {
    ReportEffort effort;
    effort.random_pushes = 24;
    effort.most_sites = 3;
    effort.pushes_at_level = 12;
    effort.pushes_of_slow_methods = 8;
    effort.several = 2;
    effort.most_zone_rings = 2;
    effort.zone_iterations = {1, 4};
    effort.most_moving_rings = 2;
    effort.most_moving_rings_of_several = 1;
    effort.cg_tolerances = {1e-1, 1e-3};
    effort.every_setting = false;
    effort.packs_of_fewer_rings = false;
    effort.timed_sets = 1;
    effort.timed_rounds = 2;
    effort.seconds = effort.seconds_of_settings = 0.06;
    effort.most_frames = 10000;
    effort.cold_frames = 4;
    effort.cold_frames_of_settings = 1;
    effort.reference_frames = 12;
    effort.newton_frames = 3;
    effort.scene_sites = 4;
    effort.scene_survey = 96;
    effort.scene_sets = 4;
    return effort;
  }
};

}  // namespace palpate
