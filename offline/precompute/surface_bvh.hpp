// surface_bvh: the touchable surface as a tree of boxes, with the normals for signed distances.
//
// Sources: MacDonald and Booth 1990 (surface area heuristic); Baerentzen and Aanaes 2005 (angle-weighted
// pseudonormals). Signed distance: a point is outside where its offset from the nearest surface point has a
// positive product with the pseudonormal of the nearest face, edge or vertex.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "offline/precompute/contact_sites.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

using PackedNormal = std::array<float, 3>;  // unit, outward

// The arrays of SurfaceBvh in schemas/pack.fbs.
struct SurfaceBvh {
  std::vector<std::array<std::uint32_t, 3>> primitives;  // sites at the corners, in the order of the leaves
  std::vector<pack::BvhNode> nodes;                      // depth-first
  std::vector<std::array<PackedNormal, 4>> primitive_normals;  // face, then the edges opposite each corner
  std::vector<PackedNormal> site_normals;
};

// Builds the tree. `surface`: the whole surface of the model, for the normals; triangles with sites at all
// corners become primitives. Equal input gives equal bits. Cost: O(n log^2 n) for n primitives.
SurfaceBvh build_surface_bvh(const Model& model, const Surface& surface, const ContactSites& sites);

}  // namespace palpate
