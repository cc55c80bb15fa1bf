// How long frames of a pack take on this machine.
#pragma once

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "offline/cli/opened_pack.hpp"

namespace palpate {

// Nanoseconds of single frames, sorted.
struct Timing {
  std::string model;
  std::string stage;
  std::vector<double> nanoseconds;
  double at(double q) const {
    return nanoseconds[static_cast<size_t>(q * static_cast<double>(nanoseconds.size() - 1))];
  }
};

// Calls frame(i) for i = 0 .. frames - 1, each timed alone, after a twentieth as many to warm up.
template <typename Frame>
Timing time_frames(std::string model, std::string stage, int frames, const Frame& frame) {
  using Clock = std::chrono::steady_clock;
  Timing timing{std::move(model), std::move(stage), std::vector<double>(static_cast<size_t>(frames))};
  for (int i = 0; i < frames / 20 + 1; ++i) frame(i);  // warm
  for (int i = 0; i < frames; ++i) {
    const Clock::time_point start = Clock::now();
    frame(i);
    timing.nanoseconds[static_cast<size_t>(i)] =
        std::chrono::duration<double, std::nano>(Clock::now() - start).count();
  }
  std::sort(timing.nanoseconds.begin(), timing.nanoseconds.end());
  return timing;
}

// Contact frames at one site for 50 frames and at a new one in each, a tool that holds one site, and visual
// frames.
std::vector<Timing> time_model(const OpenedPack& opened, pal_model model, int frames);

// Opening the pack's file, which is in the system's cache by then, and making a session.
std::vector<Timing> time_start(const std::filesystem::path& file);

// Contact frames as the scene will see them at worst: as many contacts as it asks for, at new sites in each.
Timing time_scene(const OpenedPack& opened, int frames);

}  // namespace palpate
