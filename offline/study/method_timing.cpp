#include "offline/study/method_timing.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "offline/study/timed_contacts.hpp"
#include "offline/study/timed_session.hpp"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

template <typename Frame>
double nanoseconds_of(const Frame& frame) {
  const Clock::time_point start = Clock::now();
  frame();
  return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
}

double quantile_of(const std::vector<double>& sorted, double q) {
  return sorted[static_cast<size_t>(q * static_cast<double>(sorted.size() - 1))];
}

}  // namespace

TimeSummary summary_of(std::vector<double> nanoseconds, const std::vector<double>& medians) {
  std::sort(nanoseconds.begin(), nanoseconds.end());
  constexpr double kMicro = 1e-3;
  const double median = quantile_of(nanoseconds, 0.5);
  const double lowest = medians.empty() ? median : *std::min_element(medians.begin(), medians.end());
  const double highest = medians.empty() ? median : *std::max_element(medians.begin(), medians.end());
  return {kMicro * median,
          kMicro * quantile_of(nanoseconds, 0.99),
          kMicro * quantile_of(nanoseconds, 0.999),
          kMicro * nanoseconds.back(),
          kMicro * lowest,
          kMicro * highest};
}

TimeSummary time_calls(int calls, const std::function<void(int)>& call) {
  constexpr int kRounds = 3;
  call(0);
  std::vector<double> all;
  std::vector<double> medians;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> round_times;
    for (int i = 0; i < std::max(1, calls / kRounds); ++i) {
      round_times.push_back(nanoseconds_of([&] { call(static_cast<int>(all.size()) + i + 1); }));
    }
    all.insert(all.end(), round_times.begin(), round_times.end());
    std::sort(round_times.begin(), round_times.end());
    medians.push_back(quantile_of(round_times, 0.5));
  }
  return summary_of(std::move(all), medians);
}

MethodTimer::MethodTimer(const OpenedPack& opened, pal_model model, std::uint32_t zone_rings,
                         std::vector<std::vector<std::uint32_t>> site_sets, double part)
    : opened_(&opened),
      model_(model),
      zone_rings_(zone_rings),
      site_sets_(std::move(site_sets)),
      reach_(part * opened.info().max_displacement),
      frames_(site_sets_.size(), 0) {}

void MethodTimer::advance(size_t set, std::vector<pal_contact>& contacts) {
  contacts.clear();
  for (const std::uint32_t site : site_sets_[set]) contacts.push_back(on_path(site, reach_, frames_[set]));
  ++frames_[set];
}

void MethodTimer::warm_up(size_t set, TimedSession& session, std::vector<pal_contact>& contacts) {
  constexpr int kFramesToThePath = 20;  // frames of a zone from rest to the path
  for (int i = 0; i < kFramesToThePath; ++i) {
    advance(set, contacts);
    session.haptic(contacts);
  }
}

void MethodTimer::time_round(double seconds, int most_frames, int cold_frames, CacheEvictor* caches) {
  const auto num_sets = static_cast<double>(site_sets_.size());
  const int most = std::max(1, static_cast<int>(most_frames / num_sets));
  std::vector<double> haptic;
  std::vector<double> visual;
  std::vector<pal_contact> contacts;
  std::vector<pal_real> field(size_t{3} * opened_->info().num_nodes);
  for (size_t set = 0; set < site_sets_.size(); ++set) {
    TimedSession session(*opened_, model_, static_cast<std::uint32_t>(site_sets_[set].size()), zone_rings_);
    warm_up(set, session, contacts);
    const Clock::time_point start = Clock::now();
    int timed = 0;
    do {
      advance(set, contacts);
      haptic.push_back(nanoseconds_of([&] { session.haptic(contacts); }));
    } while (++timed < most &&
             std::chrono::duration<double>(Clock::now() - start).count() < seconds / num_sets);
    session.visual(field.data());
    for (int i = 0; i < timed; ++i) visual.push_back(nanoseconds_of([&] { session.visual(field.data()); }));
    for (size_t i = set; i < static_cast<size_t>(std::max(0, cold_frames)); i += site_sets_.size()) {
      advance(set, contacts);
      caches->evict();
      haptic_.cold.push_back(nanoseconds_of([&] { session.haptic(contacts); }));
      caches->evict();
      visual_.cold.push_back(nanoseconds_of([&] { session.visual(field.data()); }));
    }
  }
  for (const auto& [stage, times] : {std::pair(&haptic_, &haptic), std::pair(&visual_, &visual)}) {
    stage->warm.insert(stage->warm.end(), times->begin(), times->end());
    std::sort(times->begin(), times->end());
    stage->medians.push_back(quantile_of(*times, 0.5));
  }
}

void MethodTimer::summarise(MethodRow& row) const {
  row.haptic = summary_of(haptic_.warm, haptic_.medians);
  row.visual = summary_of(visual_.warm, visual_.medians);
  const auto cold = [](const Stage& stage) {
    return stage.cold.empty() ? std::nullopt : std::optional(summary_of(stage.cold, {}));
  };
  row.haptic_cold = cold(haptic_);
  row.visual_cold = cold(visual_);
}

}  // namespace palpate
