// Contacts and places of the timed frames: at sites, between sites, on smooth paths.
#pragma once

#include <cstdint>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"

namespace palpate {

constexpr int kTimedContacts = 4096;  // length of the random series below

// Returns a contact whose d moves smoothly on the sphere |d| = `reach`, by about 0.01 radians a frame.
pal_contact on_path(std::uint32_t site, double reach, int frame);

// Draws contacts with d in the ball of the largest |d|: all at the first site, or at the sites in turn.
std::vector<pal_contact> random_contacts(const OpenedPack& opened, bool new_site_each_frame);

// Returns on_path() at half of the largest |d|. At 1 kHz the speed is realistic for a hand.
pal_contact half_way_out(const OpenedPack& opened, std::uint32_t site, int frame);

// Returns the number of simultaneous zone contacts that the scene allows.
std::uint32_t num_in_zones(const OpenedPack& opened);

// Chooses `count` sites: the first, then repeatedly the site farthest from all chosen sites.
std::vector<std::uint32_t> sites_apart(const OpenedPack& opened, std::uint32_t count);

// Chooses up to `count` sites near the first site, whose mutual distance exceeds two patch radii.
std::vector<std::uint32_t> sites_together(const OpenedPack& opened, std::uint32_t count);

// Returns half_way_out() for each site.
std::vector<pal_contact> all_on_paths(const OpenedPack& opened, const std::vector<std::uint32_t>& sites,
                                      int frame);

// Draws places within one edge of the sites, site after site: metres, organ frame.
std::vector<Eigen::Vector3d> random_places(const OpenedPack& opened);

pal_surface_point surface_point(const OpenedPack& opened, const Eigen::Vector3d& place);

// Returns a path half an edge above the surface, from the first site to the farthest site and back. The path
// follows the surface points nearest to the chord, in steps of 0.01 edges along the chord. The path omits
// places near the opposite wall of a fissure. Metres, organ frame.
std::vector<Eigen::Vector3d> path_above_surface(const OpenedPack& opened);

// Places the contacts of random_contacts() at the places of random_places().
std::vector<pal_contact> random_points(const OpenedPack& opened);

// Returns the number of linear_dd contacts between sites in a timed frame, at most three.
std::uint32_t num_between(const OpenedPack& opened);

}  // namespace palpate
