// surface_bvh: the point of the touchable surface nearest to a tool's tip, and the signed distance to it.
//
// A search of the pack's tree of boxes, nearer child first, that passes over what lies farther than the best
// found so far. Whether the tip is inside is the sign of its offset along the normal of the feature (face,
// edge or vertex) that the nearest point lies on: Baerentzen and Aanaes 2005, "Signed distance computation
// using the angle weighted pseudonormal". That sign is right wherever the nearest point of the touchable
// surface is also the nearest one of the whole: not where the tip is nearer to tissue beyond its rim.
#pragma once

#include <palpate/palpate.h>
#include <stdint.h>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

// Coordinates up to this are answered: what a pack's own may be.
inline constexpr double kLargestPosition = 1e15;

struct SurfaceHit {
  uint32_t primitive;
  uint32_t sites[3];  // at its corners; three times the same for a site alone
  double weights[3];  // of the corners: >= 0, their sum 1
  double point[3];    // the weighted mean of the corners
  double normal[3];   // unit, outward: of the face, edge or vertex that the point lies on
  double distance;    // from the surface, negative inside
};

// What a search looked at.
struct SurfaceVisits {
  uint32_t nodes;
  uint32_t primitives;
};

// Model units. False, and nothing written, where the pack has no tree or a coordinate is not within
// kLargestPosition. Of primitives equally near the one with the smallest index is hit, whatever
// `start_primitive` is: that of the frame before makes the search short, any other (0) is as good for a
// first one. `visits` may be null.
// Cost near the surface of 2,654 triangles: 41 boxes and 9 triangles, 0.5 us; all of them where all are
// equally near to rounding, as from the centre of a ball, or from 1e14 times the surface's size.
bool find_nearest_surface_point(const pal_pack& pack, const double position[3], uint32_t start_primitive,
                                SurfaceHit& hit, SurfaceVisits* visits = nullptr);

// Whether nodes are what schemas/pack_layout.hpp says: each reached once and not too deep, each primitive in
// one leaf, every box around what is below it. Primitives, sites and positions have been checked. A search
// relies on it.
bool is_surface_tree(const pal_pack& pack);

}  // namespace palpate
