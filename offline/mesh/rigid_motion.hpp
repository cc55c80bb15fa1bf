// Finds the rigid motions of a body that its held degrees of freedom leave free.
#pragma once

#include <string>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

// Returns the part of each node, and -1 for a node without element. A part is a set of elements that are
// connected through nodes. Parts are numbered by first node.
std::vector<int> connected_parts(const Model& model);

// Names a set of elements with a free rigid motion.
struct LoosePart {
  int node = 0;  // a node of the set
  // One for each free motion, at least one: "move along x", "turn about an axis along z"; "move as a
  // whole": any other motion.
  std::vector<std::string> motions;
};

// Returns the parts that `held` leaves loose, by first node. Prescribed values do not matter.
//
// A rigid motion moves a point p by t + w x (p - c), with any fixed point c. A held dof (node, axis) demands
// that this displacement is 0 along the axis, which is a row of six numbers on (t, w). Rank 6 of the rows
// holds a part.
std::vector<LoosePart> loose_parts(const Model& model, const std::vector<PrescribedDisplacement>& held);

// Returns the blocks that may move about the corner or edge that attaches them. A block is a set of elements
// that are joined face to face. A block is fixed if its held dofs and the nodes that it shares with fixed
// blocks stop all six rigid motions. The function judges one block at a time, so it also returns blocks that
// only hold each other. It returns none if all elements are one block. Call it where loose_parts() finds
// none. `held` is sorted by node. Cost: O(elements log elements), and a pass over the nodes for each block of
// a chain of blocks.
std::vector<LoosePart> hinged_parts(const Model& model, const std::vector<PrescribedDisplacement>& held);

}  // namespace palpate
