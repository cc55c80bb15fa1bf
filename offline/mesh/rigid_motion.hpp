// Finds the rigid motions of a body that its held degrees of freedom leave free.
#pragma once

#include <string>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

// Returns for each node its part, connected through shared nodes of elements. Parts are numbered by first
// node; -1 for a node without element.
std::vector<int> connected_parts(const Model& model);

// A part with a free rigid motion.
struct LoosePart {
  int node = 0;        // its first node
  std::string motion;  // "move along x", "turn about an axis along z", or "move as a whole"
};

// Returns the parts that `held` leaves loose, by first node; prescribed values do not matter.
//
// A motion t + w x (x - c) leaves a held dof (node, axis) in place if its component along the axis is 0
// there. Each held dof is thus a row of six numbers; rank 6 of the rows holds a part.
std::vector<LoosePart> loose_parts(const Model& model, const std::vector<PrescribedDisplacement>& held);

// Returns parts that may turn about the corner or edge that attaches them. Neither `held` nor nodes shared
// with a held part stop their rotation. Some mutually braced parts are false positives. `held` is sorted by
// node. Cost: O(elements log elements), and a pass over the nodes for each link of a chain of such parts.
std::vector<LoosePart> hinged_parts(const Model& model, const std::vector<PrescribedDisplacement>& held);

}  // namespace palpate
