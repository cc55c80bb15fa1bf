// Whether a body is held: which of its six rigid motions the held degrees of freedom leave free.
#pragma once

#include <string>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

// The parts of the model that are connected through shared nodes of elements: the part of each node, numbered
// in the order of their first nodes; -1 for a node of no element.
std::vector<int> connected_parts(const Model& model);

// A part that can still move as a whole.
struct LoosePart {
  int node = 0;        // its first node
  std::string motion;  // "move along x", "turn about an axis along z", or "move as a whole"
};

// The parts that `held` (their values do not matter) leaves loose, in the order of their first nodes.
//
// A motion t + w x (x - c) leaves the held dof (node, axis) in place if its axis component there is 0. Each
// held dof is thus a row of six numbers, and a part is held when its rows have rank 6.
std::vector<LoosePart> loose_parts(const Model& model, const std::vector<PrescribedDisplacement>& held);

// The parts of elements joined face to face that nothing stops from turning about the corner or edge by which
// they hang on others: neither `held` nor nodes shared with parts that stand. A few hinged parts that brace
// each other are reported too, though they stand. `held` is sorted
// by node. Cost: O(elements log elements), and a pass over the nodes for each link of a chain of such parts.
std::vector<LoosePart> hinged_parts(const Model& model, const std::vector<PrescribedDisplacement>& held);

}  // namespace palpate
