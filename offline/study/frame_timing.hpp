// Measures the frame times of a pack on this machine.
#pragma once

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"

namespace palpate {

// Times of single frames.
struct Timing {
  std::string model;                // "" for a time that belongs to no model
  std::string stage;                // the timed operation: "force + stiffness"
  std::vector<double> nanoseconds;  // of each frame, ascending
  double at(double q) const {       // quantile q in [0, 1]
    return nanoseconds[static_cast<size_t>(q * static_cast<double>(nanoseconds.size() - 1))];
  }
};

// Times each frame(i), i = 0 .. frames - 1, alone, after a warm-up. prepare() runs untimed before each frame.
template <typename Frame, typename Prepare = void (*)()>
Timing time_frames(
    std::string model, std::string stage, int frames, const Frame& frame, const Prepare& prepare = [] {}) {
  using Clock = std::chrono::steady_clock;
  Timing timing{std::move(model), std::move(stage), std::vector<double>(static_cast<size_t>(frames))};
  for (int i = 0; i < frames / 20 + 1; ++i) frame(i);  // warm-up
  for (int i = 0; i < frames; ++i) {
    prepare();
    const Clock::time_point start = Clock::now();
    frame(i);
    timing.nanoseconds[static_cast<size_t>(i)] =
        std::chrono::duration<double, std::nano>(Clock::now() - start).count();
  }
  std::sort(timing.nanoseconds.begin(), timing.nanoseconds.end());
  return timing;
}

// Empties the caches by a walk through 96 MB, more than the caches hold. Cost: about 10 ms.
class CacheEvictor {
 public:
  void evict();

 private:
  std::vector<unsigned char> buffer_ = std::vector<unsigned char>(size_t{96} << 20);
};

// Times a memcpy of `bytes`, as many as a field reads: the bound that memory sets.
Timing time_copy(const std::string& model, std::uint64_t bytes, int frames);

// Times a loop in registers. A spread above its median is noise of the machine.
Timing time_loop(int frames);

// Returns the processor's name from /proc/cpuinfo.
std::string processor_name();

// Times one model: contact frames at and between sites, frames of a tool that holds a site, visual frames.
std::vector<Timing> time_model(const OpenedPack& opened, pal_model model, int frames);

// Times nonlinear_zone: contact frames on a smooth path and visual frames for each number of rings. Also
// times the preparation of new zones and the iterations of the refining lane.
std::vector<Timing> time_zone(const OpenedPack& opened, int frames);

// Whether the pack carries the surface_bvh, which contacts between sites need.
bool has_places(const OpenedPack& opened);

// Times pal_pack_find_surface_point at places about an edge from the surface, and at places on the surface.
// Also times frames of a tool half an edge above the surface. The pack must have places (has_places).
std::vector<Timing> time_search(const OpenedPack& opened, int frames);

// Times the opening of a cached pack file and the construction of a session.
std::vector<Timing> time_start(const std::filesystem::path& file);

// Contact frames in the worst case of the scene.
struct SceneTiming {
  Timing frame;
  std::uint32_t contacts;  // number that the scene asks for and the model supports
  bool is_zone;  // contacts move at fixed sites, as zones need preparation; else new sites in each frame
};
SceneTiming time_scene(const OpenedPack& opened, int frames);

// Times linear_dd with two or three contacts at new places between sites in each frame. Empty for packs with
// zones, and for packs without linear_dd, without a surface_bvh or for one contact.
std::optional<Timing> time_new_places(const OpenedPack& opened, int frames);

}  // namespace palpate
