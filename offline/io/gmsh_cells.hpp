// The element types of Gmsh: numbers, names and orders of nodes.
//
// Source: Gmsh 4.11 reference manual, section "MSH file format", and section "Node ordering".
#pragma once

#include <optional>
#include <span>
#include <string>

#include "offline/io/mesh_data.hpp"

namespace palpate {

struct GmshType {
  int number = 0;
  CellKind kind = CellKind::point;
  int num_nodes = 0;
  const char* name = "";     // for messages: "quadratic hexahedra of 20 nodes"
  bool is_supported = true;  // false: a volume of higher order than two
};

inline constexpr int kMostGmshNodes = 36;  // nodes of the largest supported type

// Returns null where the type is unknown.
const GmshType* find_gmsh_type(int number);

// Returns the type of a cell that is to be written.
const GmshType& gmsh_type(const MeshCell& cell);

// Returns the number of nodes that a MeshCell keeps: the corners, and the middles of tetrahedra.
int num_kept_nodes(const GmshType& type);

// Returns the place of node `i` of a MeshCell in the order of Gmsh. Gmsh swaps the last two middles of
// tetrahedra: 01 12 02 03 23 13. The function is its own inverse.
int gmsh_place(const GmshType& type, int i);

}  // namespace palpate
