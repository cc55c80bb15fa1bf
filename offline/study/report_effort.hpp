// The effort of a report: sizes and time limits of its measurements. quick() gives a first look.
#pragma once

#include <cstddef>
#include <vector>

namespace palpate {

struct ReportEffort {
  int random_pushes = 512;           // pushes for the validation and the error distributions
  int most_sites = 12;               // sites of the comparison of methods
  int pushes_at_level = 144;         // pushes for each |d|
  int pushes_of_slow_methods = 24;   // the same for thick zones that move or come from another pack
  int several = 32;                  // pushes of several contacts for each |d|
  int several_of_slow_methods = 12;  // the same for thick zones: the first of these pushes
  int most_zone_rings = 4;           // for methods that the pack does not carry
  std::vector<int> zone_iterations = {1, 2, 3, 4, 5};  // in each frame of a zone with moving contacts
  int most_moving_rings = 4;                           // for zones with moving contacts
  int most_moving_rings_of_several = 2;                // for zones with several moving contacts
  std::vector<double> cg_tolerances = {1e-1, 1e-2, 1e-3,
                                       1e-4};  // tolerances of localised conjugate gradients
  bool every_setting = true;                   // false: a few settings of polynomials
  size_t timed_sets = 4;                       // sets of sites in the timing of a method
  int timed_rounds = 5;                        // rounds for each method
  double seconds = 0.6;                        // warm frames of a method at one |d|
  double seconds_of_settings = 0.2;            // the same for settings that the pack does not carry
  int most_frames = 100000;                    // limit of warm frames
  int cold_frames = 60;
  int cold_frames_of_settings = 12;
  int reference_frames = 120;  // frames of linear references
  int newton_frames = 12;      // frames of full Newton
  int scene_sites = 24;        // limit for a scene that is packed for the report
  int scene_sets = 0;          // contact sets of the scene's survey

  // A first look: few pushes give a weaker validation.
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
    effort.timed_sets = 1;
    effort.timed_rounds = 2;
    effort.seconds = effort.seconds_of_settings = 0.06;
    effort.most_frames = 10000;
    effort.cold_frames = 4;
    effort.cold_frames_of_settings = 1;
    effort.reference_frames = 12;
    effort.newton_frames = 3;
    effort.scene_sites = 4;
    effort.scene_sets = 4;
    return effort;
  }
};

}  // namespace palpate
