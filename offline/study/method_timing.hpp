// Microseconds of a method's frames: contacts on a path, and the field of all shown nodes.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"
#include "offline/study/frame_timing.hpp"
#include "offline/study/organ_measurements.hpp"

namespace palpate {

class TimedSession;

// Frames of one model on a pack, `contacts` sites at a time, that go around at `part` of the pack's largest |d|. Each
// set of sites is timed in a session of its own that lives no longer than that, so that many timers hold no arenas.
class MethodTimer {
 public:
  // `site_sets`: of equally many sites each; frames are shared among them. `zone_rings`, `zone_iterations`: as of a
  // session. The pack outlives this.
  MethodTimer(const OpenedPack& opened, pal_model model, std::uint32_t zone_rings,
              std::uint32_t zone_iterations, std::vector<std::vector<std::uint32_t>> site_sets, double part);

  // One more round: `seconds` or `most_frames`, whichever is less, and `cold_frames` more, before each of which
  // `caches`, not null then, are emptied.
  void time_round(double seconds, int most_frames, int cold_frames = 0, CacheEvictor* caches = nullptr);
  // Into the row; cold times where there are any.
  void summarise(MethodRow& row) const;

 private:
  struct Stage {
    std::vector<double> warm;  // nanoseconds
    std::vector<double> cold;
    std::vector<double> medians;  // of rounds
  };
  void advance(size_t set, std::vector<pal_contact>& contacts);
  // From rest to the path of the set's contacts.
  void warm_up(size_t set, TimedSession& session, std::vector<pal_contact>& contacts);

  const OpenedPack* opened_;
  pal_model model_;
  std::uint32_t zone_rings_;
  std::uint32_t zone_iterations_;
  std::vector<std::vector<std::uint32_t>> site_sets_;
  double reach_;
  std::vector<int> frames_;  // of each set, so far
  Stage haptic_;
  Stage visual_;
};

// Of frames that are no runtime's: so many calls, each timed alone; with `caches` those are emptied before each.
TimeSummary time_calls(int calls, const std::function<void(int)>& call, CacheEvictor* caches = nullptr);

// `medians`: of the rounds, nanoseconds too; empty: it was one.
TimeSummary summary_of(std::vector<double> nanoseconds, const std::vector<double>& medians);

}  // namespace palpate
