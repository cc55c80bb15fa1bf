// surface_bvh: the touchable surface as a tree of boxes, with the normals for signed distances.
//
// Sources: MacDonald and Booth 1990 (surface area heuristic); Baerentzen and Aanaes 2005 (angle-weighted
// pseudonormals: the offset from the nearest surface point along the pseudonormal of its face, edge or vertex
// has the sign of the distance).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "offline/precompute/contact_sites.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

using PackedNormal = std::array<float, 3>;  // unit, outward

// As SurfaceBvh in schemas/pack.fbs.
struct SurfaceBvh {
  std::vector<std::array<std::uint32_t, 3>> primitives;  // sites at the corners, in the order of the leaves
  std::vector<pack::BvhNode> nodes;                      // depth-first
  std::vector<std::array<PackedNormal, 4>> primitive_normals;  // face, then the edges opposite each corner
  std::vector<PackedNormal> site_normals;
};

// `surface` is the model's whole surface and gives the normals; triangles with sites give the primitives.
// Equal input gives equal bits. Cost: O(n log^2 n) for n primitives.
SurfaceBvh build_surface_bvh(const Model& model, const Surface& surface, const ContactSites& sites);

}  // namespace palpate
