// Contacts and places of the timed frames: at sites, between sites, on smooth paths.
#pragma once

#include <cstdint>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"

namespace palpate {

constexpr int kTimedContacts = 4096;

// Returns a contact on a smooth path at radius `reach`, 0.01 radians a frame; the runtime's units.
pal_contact on_path(std::uint32_t site, double reach, int frame);

// Draws contacts in the sampled ball: all at the first site, or each at the next site.
std::vector<pal_contact> random_contacts(const OpenedPack& opened, bool new_site_each_frame);

// Half of the scene's range: a realistic speed of a hand at 1 kHz.
pal_contact half_way_out(const OpenedPack& opened, std::uint32_t site, int frame);

// Number of simultaneous zone contacts that the scene allows.
std::uint32_t num_in_zones(const OpenedPack& opened);

// Chooses the first site, then repeatedly the site farthest from all chosen sites.
std::vector<std::uint32_t> sites_apart(const OpenedPack& opened, std::uint32_t count);

// Chooses the first site and near sites whose mutual distance exceeds two patch radii; possibly fewer than `count`.
std::vector<std::uint32_t> sites_together(const OpenedPack& opened, std::uint32_t count);

// Returns a contact on its path for each site.
std::vector<pal_contact> all_on_paths(const OpenedPack& opened, const std::vector<std::uint32_t>& sites,
                                      int frame);

// Draws places within one edge of the sites, site after site: metres, organ frame.
std::vector<Eigen::Vector3d> random_places(const OpenedPack& opened);

pal_surface_point surface_point(const OpenedPack& opened, const Eigen::Vector3d& place);

// Returns a path half an edge above the surface, from the first site to the farthest site and back. The path
// follows the surface points nearest to the chord, in steps of 0.01 edges. Places near the opposite wall of a
// fissure are left out. Metres, organ frame.
std::vector<Eigen::Vector3d> path_above_surface(const OpenedPack& opened);

// Places the contacts of random_contacts() at the places of random_places().
std::vector<pal_contact> random_points(const OpenedPack& opened);

// Number of linear_dd contacts between sites. The runtime moves further contacts to the nearest site.
std::uint32_t num_between(const OpenedPack& opened);

}  // namespace palpate
