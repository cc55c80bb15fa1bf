#include "offline/study/frame_timing.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fstream>
#include <numeric>
#include <random>
#include <set>
#include <thread>

#include "offline/study/timed_contacts.hpp"
#include "offline/study/timed_session.hpp"

namespace palpate {
namespace {

// Times frames whose pack and session are in no cache.
template <typename Frame>
Timing time_cold(std::string model, std::string stage, const Frame& frame) {
  constexpr int kFrames = 200;
  CacheEvictor caches;
  return time_frames(std::move(model), std::move(stage), kFrames, frame, [&] { caches.evict(); });
}

// Times several contacts at fixed places, or at new places in each frame.
Timing time_several_between(const OpenedPack& opened, const std::vector<pal_contact>& points, bool new_places,
                            int frames) {
  const std::uint32_t count = num_between(opened);
  TimedSession session(opened, PAL_MODEL_LINEAR, count);
  std::vector<pal_contact> contacts(count);
  // random_places() cycles through the sites: this stride gives each contact another site.
  const size_t stride = opened.info().num_sites / count;
  return time_frames(
      model_name(PAL_MODEL_LINEAR),
      fmt::format("{} contacts{}", count, new_places ? ", new places each frame" : " between sites"), frames,
      [&](int frame) {
        const auto first = new_places ? static_cast<size_t>(frame) : 0;
        for (std::uint32_t c = 0; c < count; ++c) {
          contacts[c] = points[(first + c * stride) % points.size()];
          std::copy_n(points[static_cast<size_t>(frame) % points.size()].displacement, 3,
                      contacts[c].displacement);
        }
        session.haptic(contacts);
      });
}

// Times the frames of tools that take hold of new sites. Between frames the refining lane prepares the zones.
// Once all zones are prepared the tools go to the next sites.
Timing time_taking_hold(const OpenedPack& opened, std::uint32_t count, int frames) {
  constexpr std::uint64_t kSlice = 200'000;  // multiply-adds of the refining lane between two frames
  TimedSession session(opened, PAL_MODEL_ZONE, count, 0, count);
  std::vector<std::uint32_t> sites = sites_apart(opened, count);
  const std::vector<pal_pose> poses(count, {{0, 0, 0}, {1, 0, 0, 0}});
  bool is_preparing = false;
  const auto between_frames = [&] {
    if (is_preparing) return session.refine(kSlice);
    for (std::uint32_t tool = 0; tool < count; ++tool) session.release(tool);
    session.tools(poses);
    for (std::uint32_t tool = 0; tool < count; ++tool) {
      sites[tool] = (sites[tool] + 1) % opened.info().num_sites;
      session.hold(sites[tool], tool);
    }
  };
  return time_frames(
      model_name(PAL_MODEL_ZONE),
      fmt::format("frames while {} new zone{} prepared", count, count > 1 ? "s are" : " is"), frames,
      [&](int) { is_preparing = (session.tools(poses) & PAL_FLAG_PREPARING) != 0; }, between_frames);
}

}  // namespace

void CacheEvictor::evict() {
  constexpr size_t kLine = 64;  // bytes of a cache line
  for (size_t i = 0; i < buffer_.size(); i += kLine) ++buffer_[i];
  asm volatile("" : : "r"(buffer_.data()) : "memory");
}

Timing time_loop(int frames) {
  volatile double start = 1;  // volatile: the compiler must keep the loop
  volatile double end = 0;
  return time_frames("", "a loop in registers", frames, [&](int) {
    double sum = start;
    for (int i = 0; i < 20000; ++i) sum = 0.5 * sum + 1;
    end = sum;
  });
}

Timing time_copy(const std::string& model, std::uint64_t bytes, int frames) {
  std::vector<unsigned char> from(bytes, 1);
  std::vector<unsigned char> to(bytes);
  return time_frames(model, fmt::format("memcpy of its {:.0f} KB", static_cast<double>(bytes) / 1024), frames,
                     [&](int) {
                       std::memcpy(to.data(), from.data(), bytes);
                       asm volatile("" : : "r"(to.data()) : "memory");
                     });
}

std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

bool has_places(const OpenedPack& opened) {
  return opened.tables().surface_bvh() != nullptr;
}

std::vector<Timing> time_model(const OpenedPack& opened, pal_model model, int frames) {
  TimedSession session(opened, model, 1);
  const std::vector<pal_contact> staying = random_contacts(opened, false);
  const std::vector<pal_contact> moving = random_contacts(opened, true);
  const auto touch = [&](const std::vector<pal_contact>& contacts) {
    return [&](int frame) { session.haptic({&contacts[static_cast<size_t>(frame) % contacts.size()], 1}); };
  };
  std::vector<Timing> timings;
  timings.push_back(time_frames(model_name(model), "force + stiffness", frames, touch(staying)));
  TimedSession held(opened, model, 1);
  held.hold(staying.front().site);
  timings.push_back(time_frames(model_name(model), "the same through a tool", frames, [&](int frame) {
    const double* d = staying[static_cast<size_t>(frame) % staying.size()].displacement;
    held.tool({{d[0], d[1], d[2]}, {1, 0, 0, 0}});
  }));
  // A single site would repeat the previous row.
  if (opened.info().num_sites > 1)
    timings.push_back(time_frames(model_name(model), "force, new site each frame", frames, touch(moving)));
  std::vector<pal_real> field(size_t{3} * opened.info().num_nodes);
  const auto show = [&](const pal_contact& contact, const char* stage) {
    session.haptic({&contact, 1});
    timings.push_back(
        time_frames(model_name(model), stage, frames, [&](int) { session.visual(field.data()); }));
  };
  show(staying.front(), "field of shown nodes");
  if (!has_places(opened)) return timings;
  const std::vector<pal_contact> points = random_points(opened);
  timings.push_back(time_frames(model_name(model), "force, between sites", frames, touch(points)));
  timings.push_back(time_cold(model_name(model), "force, between sites, cold", touch(points)));
  const auto inside = std::find_if(points.begin(), points.end(), [](const pal_contact& contact) {
    return contact.neighbour_weights[0] > 0 && contact.neighbour_weights[1] > 0 &&
           contact.neighbour_weights[0] + contact.neighbour_weights[1] < 1;
  });
  if (inside != points.end()) show(*inside, "field, between sites");
  if (model == PAL_MODEL_LINEAR && num_between(opened) > 1) {
    timings.push_back(time_several_between(opened, points, false, frames));
    timings.push_back(time_several_between(opened, points, true, std::max(100, frames / 100)));
  }
  return timings;
}

// Times frames of moving contacts at 1 kHz while another thread runs the refining lane.
Timing time_beside_lane(const OpenedPack& opened, const std::vector<std::uint32_t>& sites,
                        std::string stage) {
  constexpr int kFrames = 3000;
  constexpr std::uint64_t kSlice = 2'000'000;
  TimedSession session(opened, PAL_MODEL_ZONE, static_cast<std::uint32_t>(sites.size()));
  int next = 0;
  session.haptic(all_on_paths(opened, sites, next++));
  const std::jthread lane([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) session.refine(kSlice);
  });
  auto due = std::chrono::steady_clock::now();
  return time_frames(
      model_name(PAL_MODEL_ZONE), std::move(stage), kFrames,
      [&](int) { session.frame_once(all_on_paths(opened, sites, next++)); },
      [&] {
        due += std::chrono::milliseconds(1);
        while (std::chrono::steady_clock::now() < due) continue;
      });
}

// Adds the times of frames beside the refining lane, and of the lane's iterations alone.
void time_refining(const OpenedPack& opened, std::uint32_t count, int frames, std::vector<Timing>& timings) {
  const std::vector<std::uint32_t> sites = sites_apart(opened, count);
  const std::string contacts_text = fmt::format("{} contact{}", count, count > 1 ? "s" : "");
  timings.push_back(time_beside_lane(opened, sites, "1 kHz beside the lane, " + contacts_text));
  TimedSession session(opened, PAL_MODEL_ZONE, count);
  int next = 0;
  const auto touch = [&] { session.haptic(all_on_paths(opened, sites, next++)); };
  touch();
  timings.push_back(time_frames(
      model_name(PAL_MODEL_ZONE), "refining iteration, " + contacts_text, frames,
      [&](int) { session.refine(); }, touch));
}

std::vector<Timing> time_zone(const OpenedPack& opened, int frames) {
  const char* model = model_name(PAL_MODEL_ZONE);
  std::vector<Timing> timings;
  std::vector<pal_real> field(size_t{3} * opened.info().num_nodes);
  for (std::uint32_t rings = 1; rings <= opened.info().zone_rings; ++rings) {
    TimedSession session(opened, PAL_MODEL_ZONE, 1, rings);
    timings.push_back(time_frames(model,
                                  fmt::format("force + stiffness, {} ring{}", rings, rings > 1 ? "s" : ""),
                                  frames, [&](int frame) {
                                    const pal_contact contact = half_way_out(opened, 0, frame);
                                    session.haptic({&contact, 1});
                                  }));
    timings.push_back(time_frames(model, fmt::format("held still, {} ring{}", rings, rings > 1 ? "s" : ""),
                                  frames, [&](int) {
                                    const pal_contact contact = half_way_out(opened, 0, frames);
                                    session.haptic({&contact, 1});
                                  }));
    timings.push_back(time_frames(model,
                                  fmt::format("field of shown nodes, {} ring{}", rings, rings > 1 ? "s" : ""),
                                  frames, [&](int) { session.visual(field.data()); }));
    const std::uint32_t count = num_in_zones(opened);
    if (count == 1) continue;
    const auto time_several = [&](const std::vector<std::uint32_t>& sites, std::string_view where) {
      TimedSession several(opened, PAL_MODEL_ZONE, count, rings);
      timings.push_back(time_frames(
          model, fmt::format("{} contacts {}, {} ring{}", sites.size(), where, rings, rings > 1 ? "s" : ""),
          frames, [&](int frame) { several.haptic(all_on_paths(opened, sites, frame)); }));
    };
    time_several(sites_apart(opened, count), "apart");
    const std::vector<std::uint32_t> together = sites_together(opened, count);
    if (together.size() > 1) time_several(together, "together");
  }
  for (const std::uint32_t count : std::set<std::uint32_t>{1, num_in_zones(opened)}) {
    time_refining(opened, count, std::max(100, frames / 100), timings);
  }
  const std::uint32_t num_sites = opened.info().num_sites;
  if (num_sites <= 1) return timings;
  const int few_frames = std::max(100, frames / 100);
  for (const std::uint32_t count : std::set<std::uint32_t>{1, num_in_zones(opened)}) {
    TimedSession session(opened, PAL_MODEL_ZONE, count);
    std::vector<pal_contact> contacts(count);
    const std::vector<std::uint32_t> apart = sites_apart(opened, count);
    std::uint32_t next = 0;
    const auto request_zones = [&] {  // moves the contacts until the lane has a zone to prepare
      do {
        session.refine();  // does the earlier work of the lane
        for (std::uint32_t c = 0; c < count; ++c) contacts[c].site = (apart[c] + next) % num_sites;
        ++next;
      } while (session.frame_once(contacts));
    };
    timings.push_back(time_frames(
        model, fmt::format("preparing {} zone{}, refining lane", count, count == 1 ? "" : "s"), few_frames,
        [&](int) { session.refine(); }, request_zones));
    timings.push_back(time_taking_hold(opened, count, std::max(100, frames / 10)));
  }
  return timings;
}

std::vector<Timing> time_search(const OpenedPack& opened, int frames) {
  const std::vector<Eigen::Vector3d> places = random_places(opened);
  std::vector<Eigen::Vector3d> on_surface;
  on_surface.reserve(places.size());
  const auto find = [&](const Eigen::Vector3d& place) { return surface_point(opened, place); };
  for (const Eigen::Vector3d& place : places) on_surface.emplace_back(find(place).position);
  const auto time = [&](const char* stage, const std::vector<Eigen::Vector3d>& from) {
    return time_frames("", stage, frames,
                       [&](int frame) { find(from[static_cast<size_t>(frame) % from.size()]); });
  };
  std::vector<Timing> timings = {time("find the surface point", places),
                                 time("the same, of a point on it", on_surface)};
  const std::vector<Eigen::Vector3d> above = path_above_surface(opened);
  if (above.empty()) return timings;
  TimedSession session(opened, PAL_MODEL_AUTO, 1);
  session.look_for_surface();
  timings.push_back(time_frames("", "a tool above the surface", frames, [&](int frame) {
    const Eigen::Vector3d& tip = above[static_cast<size_t>(frame) % above.size()];
    if (session.tool({{tip[0], tip[1], tip[2]}, {1, 0, 0, 0}}) > 0)
      throw std::runtime_error("a tool above the surface holds it");
  }));
  return timings;
}

std::vector<Timing> time_start(const std::filesystem::path& file) {
  constexpr int kTimes = 50;
  std::vector<Timing> timings;
  for (const pal_verify verify : {PAL_VERIFY_ONCE, PAL_VERIFY_NEVER}) {
    const char* stage = verify == PAL_VERIFY_ONCE ? "open, verify once" : "open, verify never";
    timings.push_back(time_frames("", stage, kTimes, [&](int) {
      Pack pack;
      require_ok(pack.open(file.c_str(), verify), file.string());
    }));
  }
  Pack pack;
  require_ok(pack.open(file.c_str()), file.string());
  const pal_session_config config = pal_default_session_config(pack.get());
  std::size_t bytes = 0;
  require_ok(Session::required_bytes(pack, config, bytes), file.string());
  AlignedBytes arena(bytes);
  timings.push_back(time_frames("", "session init", kTimes, [&](int) {
    Session session;
    require_ok(session.init(pack, config, arena.bytes()), file.string());
  }));
  return timings;
}

std::optional<Timing> time_new_places(const OpenedPack& opened, int frames) {
  const pal_pack_info info = opened.info();
  if (info.has_linear == 0 || info.zone_rings > 0 || !has_places(opened) || num_between(opened) == 1)
    return {};
  return time_several_between(opened, random_points(opened), true, frames);
}

SceneTiming time_scene(const OpenedPack& opened, int frames) {
  const pal_pack_info info = opened.info();
  const bool several = info.has_linear != 0;  // polynomials support one contact only
  const std::uint32_t count = several ? std::min(info.max_contacts, info.num_sites) : 1;
  TimedSession session(opened, PAL_MODEL_AUTO, count);
  if (info.zone_rings > 0 && (count > 1 || info.has_polynomial == 0)) {
    const std::uint32_t in_zones = std::min(count, pack::kMostZoneContacts);
    const std::vector<std::uint32_t> sites = sites_apart(opened, in_zones);
    const Timing frame = time_frames("", "scene", frames,
                                     [&](int index) { session.haptic(all_on_paths(opened, sites, index)); });
    return {frame, in_zones, true};
  }
  // Draws the sites of each set anew, without repetition within a set.
  std::vector<pal_contact> contacts = random_contacts(opened, true);
  std::vector<std::uint32_t> order(info.num_sites);
  std::iota(order.begin(), order.end(), 0u);
  std::mt19937 generator(2);
  for (size_t first = 0; first + count <= contacts.size(); first += count) {
    std::shuffle(order.begin(), order.end(), generator);
    for (size_t i = 0; i < count; ++i) contacts[first + i].site = order[i];
  }
  const size_t num_sets = contacts.size() / count;
  const Timing frame = time_frames("", "scene", frames, [&](int index) {
    session.haptic({&contacts[static_cast<size_t>(index) % num_sets * count], count});
  });
  return {frame, count, false};
}

}  // namespace palpate
