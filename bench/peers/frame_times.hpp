// Times of single frames, with warm or cold caches.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace palpate::peers {

inline double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Seconds of single frames, including the reading of the clock.
class FrameTimes {
 public:
  template <typename Frame>
  void time(Frame&& frame) {
    const double start = now();
    frame();
    seconds_.push_back(now() - start);
    sorted_ = false;
  }
  // Returns a quantile in microseconds: the fraction `part` of the frames took no longer.
  double at(double part) const {
    if (!sorted_) std::sort(seconds_.begin(), seconds_.end());
    sorted_ = true;
    return 1e6 * seconds_.at(static_cast<std::size_t>(part * static_cast<double>(seconds_.size() - 1)));
  }
  double median() const { return at(0.5); }
  std::size_t count() const { return seconds_.size(); }

 private:
  mutable std::vector<double> seconds_;
  mutable bool sorted_ = true;
};

inline std::string in_us(double microseconds) {
  return microseconds < 0.9995  ? fmt::format("{:.3f}", microseconds)
         : microseconds < 999.5 ? fmt::format("{:.3g}", microseconds)
                                : fmt::format("{:.0f}", microseconds);
}

// Empties the caches by a walk through 64 MB, more than the caches hold.
class CacheEvictor {
 public:
  void evict() {
    constexpr std::size_t kLine = 64;
    for (std::size_t at = 0; at < lines_.size(); at += kLine) lines_[at] = static_cast<char>(lines_[at] + 1);
  }

 private:
  std::vector<char> lines_ = std::vector<char>(std::size_t{64} << 20);
};

// Returns the microseconds that a read of the clock adds to a frame.
inline double clock_microseconds() {
  FrameTimes times;
  for (int i = 0; i < 10000; ++i) times.time([] {});
  return times.median();
}

inline std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "an unknown processor";
}

}  // namespace palpate::peers
