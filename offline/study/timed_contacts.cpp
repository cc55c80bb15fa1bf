#include "offline/study/timed_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

namespace palpate {
namespace {

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

// Returns the sites at rest: metres, organ frame.
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

}  // namespace

pal_contact on_path(std::uint32_t site, double reach, int frame) {
  const double t = 0.01 * frame;
  pal_contact contact = {site, {}, 0, {}, {}, {}};
  contact.displacement[0] = reach * std::cos(t) * std::cos(0.37 * t);
  contact.displacement[1] = reach * std::cos(t) * std::sin(0.37 * t);
  contact.displacement[2] = reach * std::sin(t);
  return contact;
}

std::vector<pal_contact> random_contacts(const OpenedPack& opened, bool new_site_each_frame) {
  const pal_pack_info info = opened.info();
  RandomBall random;
  std::vector<pal_contact> contacts;
  for (std::uint32_t i = 0; i < kTimedContacts; ++i) {
    const Eigen::Vector3d d = info.max_displacement * random();
    const std::uint32_t site = new_site_each_frame ? i % info.num_sites : 0;
    contacts.push_back({site, {d[0], d[1], d[2]}, 0, {}, {}, {}});
  }
  return contacts;
}

pal_contact half_way_out(const OpenedPack& opened, std::uint32_t site, int frame) {
  return on_path(site, 0.5 * opened.info().max_displacement, frame);
}

std::uint32_t num_in_zones(const OpenedPack& opened) {
  const pal_pack_info info = opened.info();
  return std::min({info.max_contacts, info.num_sites, pack::kMostZoneContacts});
}

std::vector<std::uint32_t> sites_apart(const OpenedPack& opened, std::uint32_t count) {
  const std::vector<Eigen::Vector3d> positions = site_positions(opened);
  std::vector<std::uint32_t> sites = {0};
  std::vector<double> distances(positions.size(), std::numeric_limits<double>::infinity());
  while (sites.size() < count) {
    for (size_t i = 0; i < positions.size(); ++i)
      distances[i] = std::min(distances[i], (positions[i] - positions[sites.back()]).norm());
    sites.push_back(
        static_cast<std::uint32_t>(std::max_element(distances.begin(), distances.end()) - distances.begin()));
  }
  return sites;
}

std::vector<std::uint32_t> sites_together(const OpenedPack& opened, std::uint32_t count) {
  const std::vector<Eigen::Vector3d> positions = site_positions(opened);
  const pal_pack_info info = opened.info();
  const double apart = 2 * std::max(info.tip_radius, 0.5 * info.mean_surface_edge);
  std::vector<std::uint32_t> order(positions.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(order, {}, [&](std::uint32_t site) { return (positions[site] - positions[0]).norm(); });
  std::vector<std::uint32_t> sites;
  for (const std::uint32_t site : order) {
    const bool is_apart = std::ranges::all_of(
        sites, [&](std::uint32_t other) { return (positions[site] - positions[other]).norm() > apart; });
    if (is_apart && sites.size() < count) sites.push_back(site);
  }
  return sites;
}

std::vector<pal_contact> all_on_paths(const OpenedPack& opened, const std::vector<std::uint32_t>& sites,
                                      int frame) {
  std::vector<pal_contact> contacts;
  for (const std::uint32_t site : sites) contacts.push_back(half_way_out(opened, site, frame));
  return contacts;
}

std::vector<Eigen::Vector3d> random_places(const OpenedPack& opened) {
  const std::vector<Eigen::Vector3d> sites = site_positions(opened);
  RandomBall random;
  std::vector<Eigen::Vector3d> places;
  for (size_t i = 0; i < kTimedContacts; ++i)
    places.emplace_back(sites[i % sites.size()] + opened.info().mean_surface_edge * random());
  return places;
}

pal_surface_point surface_point(const OpenedPack& opened, const Eigen::Vector3d& place) {
  pal_surface_point point;
  require_ok(pal_pack_find_surface_point(opened.pack().get(), place.data(), &point), "surface point");
  return point;
}

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

std::vector<pal_contact> random_points(const OpenedPack& opened) {
  std::vector<pal_contact> contacts;
  const std::vector<pal_contact> pushes = random_contacts(opened, true);
  for (const Eigen::Vector3d& place : random_places(opened)) {
    const pal_surface_point point = surface_point(opened, place);
    contacts.push_back(pal_contact_at(&point, pushes[contacts.size()].displacement));
  }
  return contacts;
}

std::uint32_t num_between(const OpenedPack& opened) {
  constexpr std::uint32_t kMostBetween = 3;
  return std::min({opened.info().max_contacts, opened.info().num_sites, kMostBetween});
}

}  // namespace palpate
