// Mends the triangles of a surface as far as no shape changes: one node for equal points, no triangle twice,
// all triangles of a part turned the same way.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "offline/io/surface_cells.hpp"

namespace palpate {

struct RepairedSurface {
  SurfaceTriangles surface;          // an edge has one or two triangles, which agree on its direction
  std::vector<std::string> remarks;  // one line for each kind of repair, with counts
};

// Welds points closer than a millionth of the surface's diagonal. A triangle that stands there twice stays
// once; two that face each other, an inner wall, both go. Throws InputError where the surface is flat, far
// too small or large for the mesher, has an edge with three or more triangles, or is one-sided. `file`: for
// messages. Cost: O(n log n).
RepairedSurface repair_surface(SurfaceTriangles surface, const std::string& file);

Eigen::AlignedBox3d box_of(const SurfaceTriangles& surface);

// "(1.5 0 -3)", for messages.
std::string place_text(const Eigen::Vector3d& point);

}  // namespace palpate
