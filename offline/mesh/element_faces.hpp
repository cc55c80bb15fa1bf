// Lists the faces of the tetrahedra, with the faces of neighbours side by side.
#pragma once

#include <array>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

// Returns the nodes of face 0 .. 3. Three corners, counter-clockwise seen from outside, precede the middle
// nodes of the edges (first-second, second-third, third-first; -1 in four-node elements). Faces follow
// Abaqus' P1 .. P4: opposite corners 3, 2, 0, 1.
std::array<int, 6> outward_face(const Tetrahedron& element, int face);

struct ElementFace {
  std::array<int, 3> sorted = {};   // corner nodes, ascending; equal for neighbours
  std::array<int, 3> outward = {};  // corner nodes, counter-clockwise seen from outside the element
  // Middle nodes between outward[0] and [1], [1] and [2], [2] and [0]; -1 in four-node elements.
  std::array<int, 3> middles = {-1, -1, -1};
  int element = 0;
  int face = 0;      // 0 .. 3, as in outward_face()
  bool even = true;  // whether `outward` is an even permutation of `sorted`
};

// Lists every face of every element, sorted by `sorted`, then by element. Cost: O(elements log elements).
std::vector<ElementFace> sorted_faces(const Model& model);

}  // namespace palpate
