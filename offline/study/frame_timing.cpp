#include "offline/study/frame_timing.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <numeric>
#include <random>
#include <set>

#include "offline/study/timed_session.hpp"

namespace palpate {
namespace {

constexpr int kContacts = 4096;

// Times frames with cold caches: neither pack nor session is cached.
template <typename Frame>
Timing time_cold(std::string model, std::string stage, const Frame& frame) {
  constexpr int kFrames = 200;
  CacheEvictor caches;
  return time_frames(std::move(model), std::move(stage), kFrames, frame, [&] { caches.evict(); });
}

class RandomBall {
 public:
  Eigen::Vector3d operator()() {
    Eigen::Vector3d point;
    do {
      point = Eigen::Vector3d(unit_(generator_), unit_(generator_), unit_(generator_));
    } while (point.norm() > 1);
    return point;
  }

 private:
  std::mt19937 generator_{1};
  std::uniform_real_distribution<double> unit_{-1, 1};
};

// Draws contacts in the sampled ball: all at the first site, or each at the next site.
std::vector<pal_contact> random_contacts(const OpenedPack& opened, bool new_site_each_frame) {
  const pal_pack_info info = opened.info();
  RandomBall random;
  std::vector<pal_contact> contacts;
  for (std::uint32_t i = 0; i < kContacts; ++i) {
    const Eigen::Vector3d d = info.max_displacement * random();
    const std::uint32_t site = new_site_each_frame ? i % info.num_sites : 0;
    contacts.push_back({site, {d[0], d[1], d[2]}, 0, {}, {}, {}});
  }
  return contacts;
}

// Half of the scene's range: a realistic speed of a hand at 1 kHz.
pal_contact half_way_out(const OpenedPack& opened, std::uint32_t site, int frame) {
  return on_path(site, 0.5 * opened.info().max_displacement, frame);
}

// Number of simultaneous zone contacts that the scene allows.
std::uint32_t num_in_zones(const OpenedPack& opened) {
  const pal_pack_info info = opened.info();
  return std::min({info.max_contacts, info.num_sites, pack::kMostZoneContacts});
}

// Metres, organ frame.
std::vector<Eigen::Vector3d> site_positions(const OpenedPack& opened) {
  const pal_pack_info info = opened.info();
  const pal_geometry geometry = opened.pack().geometry();
  std::vector<Eigen::Vector3d> positions;
  for (std::uint32_t site = 0; site < info.num_sites; ++site) {
    std::uint32_t node = 0;
    require_ok(pal_pack_get_site_node(opened.pack().get(), site, &node), "site");
    positions.emplace_back(info.metres_per_length_unit *
                           Eigen::Vector3d(geometry.rest_positions + size_t{3} * node));
  }
  return positions;
}

// Chooses the first site, then repeatedly the site farthest from all chosen sites.
std::vector<std::uint32_t> sites_apart(const OpenedPack& opened, std::uint32_t count) {
  const std::vector<Eigen::Vector3d> positions = site_positions(opened);
  std::vector<std::uint32_t> sites = {0};
  std::vector<double> farness(positions.size(), std::numeric_limits<double>::infinity());
  while (sites.size() < count) {
    for (size_t i = 0; i < positions.size(); ++i)
      farness[i] = std::min(farness[i], (positions[i] - positions[sites.back()]).norm());
    sites.push_back(
        static_cast<std::uint32_t>(std::max_element(farness.begin(), farness.end()) - farness.begin()));
  }
  return sites;
}

// Chooses the first site and near sites whose mutual distance exceeds two patch radii; possibly fewer than `count`.
std::vector<std::uint32_t> sites_together(const OpenedPack& opened, std::uint32_t count) {
  const std::vector<Eigen::Vector3d> positions = site_positions(opened);
  const pal_pack_info info = opened.info();
  const double apart = 2 * std::max(info.tip_radius, 0.5 * info.mean_surface_edge);
  std::vector<std::uint32_t> nearest(positions.size());
  std::iota(nearest.begin(), nearest.end(), 0u);
  std::ranges::sort(nearest, {}, [&](std::uint32_t site) { return (positions[site] - positions[0]).norm(); });
  std::vector<std::uint32_t> sites;
  for (const std::uint32_t site : nearest) {
    const bool is_apart = std::ranges::all_of(
        sites, [&](std::uint32_t other) { return (positions[site] - positions[other]).norm() > apart; });
    if (is_apart && sites.size() < count) sites.push_back(site);
  }
  return sites;
}

// Returns a contact on its path for each site.
std::vector<pal_contact> all_on_paths(const OpenedPack& opened, const std::vector<std::uint32_t>& sites,
                                      int frame) {
  std::vector<pal_contact> contacts;
  for (const std::uint32_t site : sites) contacts.push_back(half_way_out(opened, site, frame));
  return contacts;
}

// Draws places within one edge of the sites, site after site: metres, organ frame.
std::vector<Eigen::Vector3d> random_places(const OpenedPack& opened) {
  const std::vector<Eigen::Vector3d> sites = site_positions(opened);
  RandomBall random;
  std::vector<Eigen::Vector3d> places;
  for (size_t i = 0; i < kContacts; ++i)
    places.emplace_back(sites[i % sites.size()] + opened.info().mean_surface_edge * random());
  return places;
}

pal_surface_point surface_point(const OpenedPack& opened, const Eigen::Vector3d& place) {
  pal_surface_point point;
  require_ok(pal_pack_find_surface_point(opened.pack().get(), place.data(), &point), "surface point");
  return point;
}

// Returns a path half an edge above the surface, from the first site to the farthest site and back. The path
// follows the surface points nearest to the chord, in steps of 0.01 edges. Places near the opposite wall of a
// fissure are left out. Metres, organ frame.
std::vector<Eigen::Vector3d> path_above_surface(const OpenedPack& opened) {
  const double edge = opened.info().mean_surface_edge;
  const std::vector<Eigen::Vector3d> sites = site_positions(opened);
  const Eigen::Vector3d& start = sites.front();
  const Eigen::Vector3d& end = *std::max_element(
      sites.begin(), sites.end(),
      [&](const auto& a, const auto& b) { return (a - start).squaredNorm() < (b - start).squaredNorm(); });
  constexpr double kStep = 0.01;  // edges
  const int steps = 1 + static_cast<int>((end - start).norm() / (kStep * edge));
  std::vector<Eigen::Vector3d> path;
  for (int i = 0; i <= steps; ++i) {
    const pal_surface_point point = surface_point(opened, start + (end - start) * i / steps);
    const Eigen::Vector3d above =
        Eigen::Vector3d(point.position) + 0.5 * edge * Eigen::Vector3d(point.normal);
    constexpr double kLeastDistance = 0.25;  // edges
    if (surface_point(opened, above).distance > kLeastDistance * edge) path.push_back(above);
  }
  for (size_t i = path.size(); i-- > 0;) path.push_back(path[i]);
  return path;
}

// Places the contacts of random_contacts() at the places of random_places().
std::vector<pal_contact> random_points(const OpenedPack& opened) {
  std::vector<pal_contact> contacts;
  const std::vector<pal_contact> pushes = random_contacts(opened, true);
  for (const Eigen::Vector3d& place : random_places(opened)) {
    const pal_surface_point point = surface_point(opened, place);
    contacts.push_back(pal_contact_at(&point, pushes[contacts.size()].displacement));
  }
  return contacts;
}

// Number of linear_dd contacts between sites. The runtime moves further contacts to the nearest site.
std::uint32_t num_between(const OpenedPack& opened) {
  constexpr std::uint32_t kMostBetween = 3;
  return std::min({opened.info().max_contacts, opened.info().num_sites, kMostBetween});
}

// Times several contacts at fixed places, or with `anew` at new places in each frame.
Timing time_several_between(const OpenedPack& opened, const std::vector<pal_contact>& points, bool anew,
                            int frames) {
  const std::uint32_t count = num_between(opened);
  TimedSession session(opened, PAL_MODEL_LINEAR, count);
  std::vector<pal_contact> contacts(count);
  // random_places() cycles through the sites; this stride separates the contacts.
  const size_t apart = opened.info().num_sites / count;
  return time_frames(model_name(PAL_MODEL_LINEAR),
                     fmt::format("{} contacts{}", count, anew ? ", new places each frame" : " between sites"),
                     frames, [&](int frame) {
                       const auto first = anew ? static_cast<size_t>(frame) : 0;
                       for (std::uint32_t c = 0; c < count; ++c) {
                         contacts[c] = points[(first + c * apart) % points.size()];
                         std::copy_n(points[static_cast<size_t>(frame) % points.size()].displacement, 3,
                                     contacts[c].displacement);
                       }
                       session.haptic(contacts);
                     });
}

// Times the frames in which tools take hold and their zones are prepared slice by slice. The last frame is
// the first with a zone response.
Timing time_slices(const OpenedPack& opened, std::uint32_t count, int frames) {
  constexpr double kSlice = 40e-6;
  TimedSession session(opened, PAL_MODEL_ZONE, count, 0, 0, kSlice);
  std::vector<std::uint32_t> sites = sites_apart(opened, count);
  const std::vector<pal_pose> poses(count, {{0, 0, 0}, {1, 0, 0, 0}});
  bool is_preparing = false;
  const auto take_hold = [&] {
    if (is_preparing) return;
    for (std::uint32_t tool = 0; tool < count; ++tool) session.release(tool);
    session.tools(poses);
    for (std::uint32_t tool = 0; tool < count; ++tool) {
      sites[tool] = (sites[tool] + 1) % opened.info().num_sites;
      session.hold(sites[tool], tool);
    }
  };
  return time_frames(
      model_name(PAL_MODEL_ZONE),
      fmt::format("{} new zone{}, {:.0f} us a frame", count, count > 1 ? "s" : "", 1e6 * kSlice), frames,
      [&](int) { is_preparing = (session.tools(poses) & PAL_FLAG_PREPARING) != 0; }, take_hold);
}

}  // namespace

void CacheEvictor::evict() {
  constexpr size_t kLine = 64;
  for (size_t i = 0; i < other_.size(); i += kLine) ++other_[i];
  asm volatile("" : : "r"(other_.data()) : "memory");
}

pal_contact on_path(std::uint32_t site, double reach, int frame) {
  const double t = 0.01 * frame;
  pal_contact contact = {site, {}, 0, {}, {}, {}};
  contact.displacement[0] = reach * std::cos(t) * std::cos(0.37 * t);
  contact.displacement[1] = reach * std::cos(t) * std::sin(0.37 * t);
  contact.displacement[2] = reach * std::sin(t);
  return contact;
}

Timing time_loop(int frames) {
  volatile double start = 1;  // volatile keeps the loop
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
  if (opened.info().num_sites == 1) return timings;
  const int few = std::max(100, frames / 100);
  for (const std::uint32_t count : std::set<std::uint32_t>{1, num_in_zones(opened)}) {
    TimedSession session(opened, PAL_MODEL_ZONE, count);
    std::vector<pal_contact> contacts(count);
    const std::vector<std::uint32_t> apart = sites_apart(opened, count);
    const std::string stage =
        count == 1 ? "force, new zone each frame" : fmt::format("{} contacts, new zones each frame", count);
    timings.push_back(time_frames(model, stage, few, [&](int frame) {
      for (std::uint32_t c = 0; c < count; ++c) {
        contacts[c].site = (apart[c] + static_cast<std::uint32_t>(frame)) % opened.info().num_sites;
      }
      session.haptic(contacts);
    }));
    timings.push_back(time_slices(opened, count, std::max(100, frames / 10)));
  }
  return timings;
}

std::vector<Timing> time_search(const OpenedPack& opened, int frames) {
  const std::vector<Eigen::Vector3d> places = random_places(opened);
  std::vector<Eigen::Vector3d> on_surface;
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
    const Timing frame =
        time_frames("", "scene", frames, [&](int at) { session.haptic(all_on_paths(opened, sites, at)); });
    return {frame, in_zones, true};
  }
  // Draws sets of different sites in random order, so that no set recurs from the frame before.
  std::vector<pal_contact> contacts = random_contacts(opened, true);
  std::vector<std::uint32_t> order(info.num_sites);
  std::iota(order.begin(), order.end(), 0u);
  std::mt19937 generator(2);
  for (size_t first = 0; first + count <= contacts.size(); first += count) {
    std::shuffle(order.begin(), order.end(), generator);
    for (size_t i = 0; i < count; ++i) contacts[first + i].site = order[i];
  }
  const size_t num_sets = contacts.size() / count;
  const Timing frame = time_frames("", "scene", frames, [&](int at) {
    session.haptic({&contacts[static_cast<size_t>(at) % num_sets * count], count});
  });
  return {frame, count, false};
}

}  // namespace palpate
