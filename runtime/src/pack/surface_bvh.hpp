// surface_bvh: the point of the touchable surface nearest to a tool's tip, and the signed distance.
//
// The search descends the pack's tree of boxes, nearer child first, and skips boxes beyond the nearest point
// so far. The nearest point lies on a feature: a face, an edge or a vertex. The tip's offset along the
// feature's normal gives the sign (Baerentzen and Aanaes 2005, "Signed distance computation using the angle
// weighted pseudonormal"). The sign is right wherever the nearest touchable point is also the nearest point
// of the whole surface.
#pragma once

#include <palpate/palpate.h>
#include <stdint.h>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

// Largest coordinate of a query, as in a pack.
inline constexpr double kLargestPosition = 1e15;

struct SurfaceHit {
  uint32_t primitive;
  uint32_t sites[3];  // sites at the corners; three equal sites for a single site
  double weights[3];  // weights of the corners: >= 0, their sum 1
  double point[3];    // the weighted mean of the corners
  double normal[3];   // unit, outward, of the feature of the point
  double distance;    // from the surface, negative inside
};

// Counts of a search.
struct SurfaceVisits {
  uint32_t nodes;
  uint32_t primitives;
};

// Finds the nearest point, in model units. False, without output, in a pack without a tree or for a
// coordinate beyond kLargestPosition. Among equally near primitives the smallest index wins. The last frame's
// primitive as `start_primitive` shortens the search and does not change the result. `visits` may be null.
bool find_nearest_surface_point(const pal_pack& pack, const double position[3], uint32_t start_primitive,
                                SurfaceHit& hit, SurfaceVisits* visits = nullptr);

// Whether the tree obeys schemas/pack_layout.hpp, as a search assumes. The caller has checked primitives,
// sites and positions. The function checks:
// - The tree reaches each node once, within kMostBvhDepth.
// - Each primitive lies in one leaf.
// - Each box contains its subtree.
bool is_surface_tree(const pal_pack& pack);

}  // namespace palpate
