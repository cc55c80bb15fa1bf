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

// Times frames of one model on a pack with `contacts` moving sites at a fraction `part` of the largest |d|.
// Each set of sites has a short-lived session, so that timers hold no arenas.
class MethodTimer {
 public:
  // `site_sets`: sets of equal size; frames are divided among the sets. `zone_rings`: as for a session. The
  // pack outlives the timer.
  MethodTimer(const OpenedPack& opened, pal_model model, std::uint32_t zone_rings,
              std::vector<std::vector<std::uint32_t>> site_sets, double part);

  // Times one more round: `seconds` or `most_frames`, whichever ends first, then `cold_frames` frames.
  // `caches` is emptied before each cold frame and must not be null for such frames.
  void time_round(double seconds, int most_frames, int cold_frames = 0, CacheEvictor* caches = nullptr);
  // Writes the times into the row; cold times where measured.
  void summarise(MethodRow& row) const;

 private:
  struct Stage {
    std::vector<double> warm;  // nanoseconds
    std::vector<double> cold;
    std::vector<double> medians;  // medians of rounds
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

// Times `calls` calls singly.
TimeSummary time_calls(int calls, const std::function<void(int)>& call);

// `medians`: of the rounds, nanoseconds; empty: a single round.
TimeSummary summary_of(std::vector<double> nanoseconds, const std::vector<double>& medians);

}  // namespace palpate
