// Measures a method's frame times in microseconds: contacts on a path, and the field of all shown nodes.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"
#include "offline/study/frame_timing.hpp"
#include "offline/study/organ_measurements.hpp"

namespace palpate {

class TimedSession;

// Times frames of one model of a pack, while contacts move at a fraction `part` of the largest |d|. Each set
// of sites gets a short-lived session, so that timers hold no arenas.
class MethodTimer {
 public:
  // `site_sets`: sets of equal size, which share the frames. The pack must outlive the timer.
  MethodTimer(const OpenedPack& opened, pal_model model, std::uint32_t zone_rings,
              std::vector<std::vector<std::uint32_t>> site_sets, double part);

  // Times one more round of `seconds` or `most_frames`, whichever ends first. Then times `cold_frames` frames
  // with emptied caches; `caches` may be null without such frames.
  void time_round(double seconds, int most_frames, int cold_frames = 0, CacheEvictor* caches = nullptr);
  // Writes the times into the row; cold times where measured.
  void summarise(MethodRow& row) const;

 private:
  struct Stage {
    std::vector<double> warm;     // nanoseconds of single frames, of all rounds
    std::vector<double> cold;     // nanoseconds
    std::vector<double> medians;  // nanoseconds, one for each round
  };
  void advance(size_t set, std::vector<pal_contact>& contacts);
  // Moves the set's contacts from rest to their path.
  void warm_up(size_t set, TimedSession& session, std::vector<pal_contact>& contacts);

  const OpenedPack* opened_;
  pal_model model_;
  std::uint32_t zone_rings_;
  std::vector<std::vector<std::uint32_t>> site_sets_;
  double reach_;
  std::vector<int> frames_;  // frames so far, for each set
  Stage haptic_;
  Stage visual_;
};

// Times `calls` calls, each alone, in three rounds.
TimeSummary time_calls(int calls, const std::function<void(int)>& call);

// Summarises times of frames. `medians`: nanoseconds, one for each round; empty: a single round.
TimeSummary summary_of(std::vector<double> nanoseconds, const std::vector<double>& medians);

}  // namespace palpate
