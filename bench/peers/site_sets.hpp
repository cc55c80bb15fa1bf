// Sets of sites that are touched together.
#pragma once

#include <cstdint>
#include <random>
#include <stdexcept>
#include <vector>

#include "bench/peers/linear_organ.hpp"

namespace palpate::peers {

// The sites around a centre, ring by ring along triangle edges, without unreachable sites.
struct SiteRings {
  std::vector<std::uint32_t> sites;
  std::vector<int> edges;  // number of edges from the centre to each of `sites`

  SiteRings(const LinearOrgan& organ, std::uint32_t centre) {
    const ContactSites& all = organ.sites;
    std::vector<int> site_of(all.packed_nodes.size(), -1);
    for (size_t site = 0; site < all.sites.size(); ++site)
      site_of[static_cast<size_t>(all.sites[site].packed_node)] = static_cast<int>(site);
    std::vector<std::vector<std::uint32_t>> neighbours(all.sites.size());
    for (const std::array<int, 3>& triangle : all.triangles) {
      for (size_t corner = 0; corner < 3; ++corner) {
        const int from = site_of[static_cast<size_t>(triangle[corner])];
        const int to = site_of[static_cast<size_t>(triangle[(corner + 1) % 3])];
        if (from >= 0 && to >= 0)
          neighbours[static_cast<size_t>(from)].push_back(static_cast<std::uint32_t>(to));
      }
    }
    std::vector<char> found(all.sites.size(), 0);
    sites = {centre};
    edges = {0};
    found[centre] = 1;
    for (size_t i = 0; i < sites.size(); ++i) {
      for (const std::uint32_t site : neighbours[sites[i]]) {
        if (found[site] != 0) continue;
        found[site] = 1;
        sites.push_back(site);
        edges.push_back(edges[i] + 1);
      }
    }
  }
};

inline std::uint32_t site_at(const LinearOrgan& organ, int label) {
  const int node = organ.model.find_node(label);
  for (std::uint32_t site = 0; site < organ.num_sites(); ++site) {
    if (organ.site_node(site) == node) return site;
  }
  throw std::runtime_error(fmt::format("node {} of {} is no site", label, organ.model.file));
}

// Returns `count` different sites, at random over the surface.
inline std::vector<std::uint32_t> random_sites(std::uint32_t num_sites, size_t count, unsigned seed) {
  if (count > num_sites) throw std::runtime_error(fmt::format("{} of {} sites", count, num_sites));
  std::mt19937 engine(seed);
  std::vector<std::uint32_t> sites(num_sites);
  for (std::uint32_t i = 0; i < num_sites; ++i) sites[i] = i;
  for (size_t i = 0; i < count; ++i) {
    const size_t left = sites.size() - i;
    if (left > 0) std::swap(sites[i], sites[i + engine() % left]);
  }
  sites.resize(count);
  return sites;
}

}  // namespace palpate::peers
