// Stiffness and labels that a mesh file has as arrays: "E" and "nu" for each cell or point, and labels of a
// segmentation.
#pragma once

#include <string>
#include <vector>

#include "offline/io/mesh_data.hpp"

namespace palpate {

// Groups of tetrahedra with nearly equal moduli. Each group becomes a material.
struct ElementModuli {
  struct Group {
    double young = 0;  // E, in the unit of the array
    double nu = 0;
  };
  std::vector<Group> groups;          // at most kMostModuli, by E, then by nu
  std::vector<int> group_of_element;  // for each tetrahedron of the mesh, in their order
  double largest_change = 0;  // largest change of E as a fraction of E: the groups take near values together
  double largest_nu_change = 0;
  std::vector<std::string> notes;  // a line each: arrays that are not read
  bool has_young = false;          // the file has E; else `groups` has the value given
  bool has_nu = false;

  bool empty() const { return groups.empty(); }
};

// More materials than this are no longer seen as numbers of their own in an .inp file.
inline constexpr int kMostModuli = 32;

// Returns the groups by the arrays E and nu, in upper or lower case, of cells or else of points (the mean
// of an element's corners). An absent array counts as `young` or `nu` everywhere. Returns no groups without
// both arrays. Up to kMostModuli different pairs stay exact. More are collected in geometric steps of 5 %
// of E and of 1/2 - nu, or in larger ones where these are too many. Throws InputError unless E > 0 and
// 0 <= nu <= kLargestRatio.
ElementModuli find_element_moduli(const MeshData& mesh, double young, double nu);

// nu above this is no longer distinguished from an incompressible tissue, which no law here describes.
inline constexpr double kLargestRatio = 0.4999;

// Turns each array of labels into element sets NAME_VALUE. A label array has one whole number for each
// cell, with 2 to kMostModuli different values on the tetrahedra.
void labels_to_sets(MeshData& mesh);

}  // namespace palpate
