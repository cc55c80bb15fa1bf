// Makes the surface of a solid out of mended triangles: small holes closed, nothing crossing, outward.
#pragma once

#include <string>
#include <vector>

#include "offline/io/surface_cells.hpp"

namespace palpate {

struct ClosedSurface {
  SurfaceTriangles surface;  // outward: seen from the solid, also around a cavity
  double area = 0;
  double volume = 0;     // of the solid, without its cavities
  int num_parts = 0;     // bodies that hang together
  int num_cavities = 0;  // surfaces inside another that bound a cavity
  std::vector<std::string> remarks;
};

inline constexpr double kLargestHole = 10;    // around, in --size
inline constexpr double kThinnestWall = 0.1;  // mean thickness, in --size

// `surface`: from repair_surface(). `size`: --size. Throws InputError with places and a remedy where a hole
// is larger than kLargestHole or cannot be filled, triangles cross, or walls are too thin for `size`.
ClosedSurface close_surface(const SurfaceTriangles& surface, double size, const std::string& file);

}  // namespace palpate
