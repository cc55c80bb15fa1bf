// How long frames of a pack take on this machine.
#pragma once

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"

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

// Calls frame(i) for i = 0 .. frames - 1, each timed alone, after a twentieth as many to warm up; before each comes
// prepare(), which is not timed.
template <typename Frame, typename Prepare = void (*)()>
Timing time_frames(
    std::string model, std::string stage, int frames, const Frame& frame, const Prepare& prepare = [] {}) {
  using Clock = std::chrono::steady_clock;
  Timing timing{std::move(model), std::move(stage), std::vector<double>(static_cast<size_t>(frames))};
  for (int i = 0; i < frames / 20 + 1; ++i) frame(i);  // warm
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

// Empties the caches, by a walk through more memory than they hold. Cost: some 10 ms.
class CacheEvictor {
 public:
  void evict();

 private:
  std::vector<unsigned char> other_ = std::vector<unsigned char>(size_t{96} << 20);
};

// A contact that goes around at `reach` from rest, a hundredth of it each frame; the runtime's units.
pal_contact on_path(std::uint32_t site, double reach, int frame);

// A copy of as many bytes as a field reads: the bound that memory sets.
Timing time_copy(const std::string& model, std::uint64_t bytes, int frames);

// A loop of some 30 us that touches no memory: what is beyond its median is the machine's.
Timing time_loop(int frames);

// As the system calls it.
std::string processor_name();

// Contact frames at one site, at a new one in each and between sites, a tool that holds the one site, and visual
// frames.
std::vector<Timing> time_model(const OpenedPack& opened, pal_model model, int frames);

// The nonlinear zone: contact frames along a smooth path, with each number of rings that the pack carries, with a new
// zone made in each, and visual frames.
std::vector<Timing> time_zone(const OpenedPack& opened, int frames);

// Whether the pack knows its surface, so that places between sites can be found.
bool has_places(const OpenedPack& opened);

// pal_pack_find_surface_point at places about an edge from the surface, another in each frame, and at places on it,
// as those of a tool that slides; and whole frames of a tool that goes half an edge above it, whose search starts
// where its last one ended: the pack has places.
std::vector<Timing> time_search(const OpenedPack& opened, int frames);

// Opening the pack's file, which is in the system's cache by then, and making a session.
std::vector<Timing> time_start(const std::filesystem::path& file);

// Contact frames as the scene will see them at worst.
struct SceneTiming {
  Timing frame;
  std::uint32_t contacts;  // as many as it asks for and the model answers
  bool
      is_zone;  // they move at the same sites, as zones are made over several frames; else at new sites in each
};
SceneTiming time_scene(const OpenedPack& opened, int frames);

// Contact frames of two or three, all at new places between sites in each, where linear_dd answers them: what a grasp
// costs in one frame where no budget spreads it.
std::optional<Timing> time_new_places(const OpenedPack& opened, int frames);

}  // namespace palpate
