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

// Nanoseconds of single frames, sorted.
struct Timing {
  std::string model;
  std::string stage;
  std::vector<double> nanoseconds;
  double at(double q) const {
    return nanoseconds[static_cast<size_t>(q * static_cast<double>(nanoseconds.size() - 1))];
  }
};

// Times frame(i) for i = 0 .. frames - 1 singly, after a warm-up of frames / 20. prepare() runs untimed
// before each frame.
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

// Empties the caches: walks through more memory than the caches hold. Cost: about 10 ms.
class CacheEvictor {
 public:
  void evict();

 private:
  std::vector<unsigned char> other_ = std::vector<unsigned char>(size_t{96} << 20);
};

// Copies the bytes of a field: the bound that memory sets.
Timing time_copy(const std::string& model, std::uint64_t bytes, int frames);

// Times a loop without memory accesses: a spread above its median is noise of the machine.
Timing time_loop(int frames);

// The system's name of the processor.
std::string processor_name();

// Times contact frames at one site, at a new site in each frame and between sites; a tool that holds the
// site; visual frames.
std::vector<Timing> time_model(const OpenedPack& opened, pal_model model, int frames);

// Times nonlinear_zone: contact frames on a smooth path for each number of rings, frames with a new zone
// each, visual frames, iterations of the refining lane.
std::vector<Timing> time_zone(const OpenedPack& opened, int frames);

// Whether the pack has the surface for contacts between sites.
bool has_places(const OpenedPack& opened);

// Times pal_pack_find_surface_point at places about an edge from the surface, and at places on the surface. Also times
// frames of a tool half an edge above the surface, whose search starts at the last result. The pack must have places.
std::vector<Timing> time_search(const OpenedPack& opened, int frames);

// Times the opening of a cached pack file and the construction of a session.
std::vector<Timing> time_start(const std::filesystem::path& file);

// Contact frames in the worst case of the scene.
struct SceneTiming {
  Timing frame;
  std::uint32_t contacts;  // number that the scene asks for and the model supports
  // true: contacts move at fixed sites, since zones take several frames to prepare; false: new sites in each frame
  bool is_zone;
};
SceneTiming time_scene(const OpenedPack& opened, int frames);

// Times linear_dd with two or three contacts at new places between sites in each frame: a grasp without a time budget.
std::optional<Timing> time_new_places(const OpenedPack& opened, int frames);

}  // namespace palpate
