// How much a report measures: enough in half an hour on two cores, or a glance in two minutes.
#pragma once

#include <array>

namespace palpate {

struct ReportEffort {
  int random_pushes = 512;    // that a pack is judged by, and its distributions of errors are of
  int most_sites = 12;        // at which methods are compared,
  int pushes_at_level = 144;  // by so many pushes of each |d|
  int several = 48;           // pushes of several contacts, of each |d|
  int most_zone_rings = 3;    // of a method that the pack does not carry
  bool every_setting = true;  // of polynomials, else a few
  double seconds = 0.6;       // of the warm frames of a method at one |d|,
  int most_frames = 100000;   // or so many of them
  int cold_frames = 60;
  int newton_frames = 12;
  int scene_sites = 0;   // of a scene that is packed for the report: at most so many; 0: all
  int scene_survey = 0;  // pushes of its survey; 0: as many as `palpate build` takes

  static ReportEffort quick() {
    ReportEffort effort;
    effort.random_pushes = 96;
    effort.most_sites = 4;
    effort.pushes_at_level = 24;
    effort.several = 3;
    effort.most_zone_rings = 2;
    effort.every_setting = false;
    effort.seconds = 0.1;
    effort.most_frames = 10000;
    effort.cold_frames = 8;
    effort.newton_frames = 3;
    effort.scene_sites = 4;
    effort.scene_survey = 128;
    return effort;
  }
};

// Of the pack's largest |d|, at which methods are compared.
inline constexpr std::array<double, 4> kReportParts = {0.25, 0.5, 0.75, 1.0};

}  // namespace palpate
