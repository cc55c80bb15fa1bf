// surface_bvh: the touchable surface as a tree of boxes, and the normals that give a distance to it its sign.
//
// Sources: MacDonald and Booth 1990 (the surface area heuristic, by which boxes are split); Baerentzen and
// Aanaes 2005 (angle-weighted pseudonormals: whether a point is inside is the sign of its offset from the
// nearest surface point along the normal of the face, edge or vertex that the point lies on).
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

// `surface` is all of the model's; normals come from all of it, primitives from where there are sites. The
// same input gives the same bits. Cost: O(n log^2 n) for n primitives.
SurfaceBvh build_surface_bvh(const Model& model, const Surface& surface, const ContactSites& sites);

}  // namespace palpate
