// The faces of the tetrahedra, those of neighbours side by side.
#pragma once

#include <array>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

// The nodes of face 0 .. 3 of an element: three corners, counter-clockwise seen from outside, then for
// ten-node elements the nodes between the first and second, second and third, third and first; else -1. The
// order of the faces is that of Abaqus' P1 .. P4: opposite corners 3, 2, 0, 1.
std::array<int, 6> outward_face(const Tetrahedron& element, int face);

struct ElementFace {
  std::array<int, 3> sorted = {};   // its corners, ascending: what neighbours share
  std::array<int, 3> outward = {};  // its corners, counter-clockwise seen from outside the element
  // Ten-node elements: the nodes between outward[0] and [1], [1] and [2], [2] and [0]; -1 for four-node ones.
  std::array<int, 3> middles = {-1, -1, -1};
  int element = 0;
  int face = 0;      // as in outward_face()
  bool even = true;  // whether `outward` is an even permutation of `sorted`
};

// Every face of every element, sorted by `sorted`, then by element. Cost: O(elements log elements), 56 bytes
// a face.
std::vector<ElementFace> sorted_faces(const Model& model);

}  // namespace palpate
