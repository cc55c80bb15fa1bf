// Triangles of surface formats, STL, OBJ and PLY.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <span>
#include <vector>

#include "offline/io/mesh_data.hpp"

namespace palpate {

// Adds the triangles of a polygon with at least three nodes, as a fan about its first node.
void add_polygon(std::span<const int> nodes, int line, MeshData& mesh);

// Removes element sets that hold every cell, such as the only solid of a file: they tell nothing apart.
void drop_whole_sets(MeshData& mesh);

struct SurfaceTriangles {
  std::vector<Eigen::Vector3d> positions;     // those that a triangle uses, in the order of the mesh
  std::vector<std::array<int, 3>> triangles;  // indices in `positions`, turned outward
};

// Returns the triangles and halved quadrilaterals of a mesh; where it has none, the outer faces of its
// tetrahedra. Throws std::runtime_error that names `file` if there are none either.
SurfaceTriangles surface_triangles(const MeshData& mesh, const std::filesystem::path& file);

}  // namespace palpate
