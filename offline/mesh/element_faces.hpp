// The faces of the tetrahedra, those of neighbours side by side.
#pragma once

#include <array>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

struct ElementFace {
  std::array<int, 3> sorted = {};   // its corners, ascending: what neighbours share
  std::array<int, 3> outward = {};  // its corners, counter-clockwise seen from outside the element
  // Ten-node elements: the nodes between outward[0] and [1], [1] and [2], [2] and [0]; -1 for four-node ones.
  std::array<int, 3> middles = {-1, -1, -1};
  int element = 0;
  bool even = true;  // whether `outward` is an even permutation of `sorted`
};

// Every face of every element, sorted by `sorted`, then by element. Cost: O(elements log elements), 52 bytes
// a face.
std::vector<ElementFace> sorted_faces(const Model& model);

}  // namespace palpate
