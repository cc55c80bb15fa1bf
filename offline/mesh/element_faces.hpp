// The faces of the tetrahedra, those of neighbours side by side.
#pragma once

#include <array>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

struct ElementFace {
  std::array<int, 3> sorted = {};   // its node indices, ascending: what neighbours share
  std::array<int, 3> outward = {};  // counter-clockwise seen from outside the element
  int element = 0;
  bool even = true;  // whether `outward` is an even permutation of `sorted`
};

// Every face of every element, sorted by `sorted`, then by element. Cost: O(elements log elements), 40 bytes
// a face.
std::vector<ElementFace> sorted_faces(const Model& model);

}  // namespace palpate
