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
  int node = 0;        // one of its nodes
  std::string motion;  // "move along x", "turn about an axis along z", or "move as a whole"
};

// Returns the parts that `held` leaves loose, by first node; prescribed values do not matter.
//
// A motion t + w x (x - c), with any fixed point c, leaves a held dof (node, axis) in place if its component along the
// axis is 0 there. Each held dof is thus a row of six numbers; rank 6 of the rows holds a part.
std::vector<LoosePart> loose_parts(const Model& model, const std::vector<PrescribedDisplacement>& held);

// Returns parts that may move about the corner or edge that attaches them. A part here is a set of elements that
// share faces. A part is fixed where its held dofs and the nodes that it shares with fixed parts stop all six rigid
// motions; the function returns the others. It looks at one part at a time, so that it also returns parts that only
// hold each other. `held` is sorted by node. Cost: O(elements log elements), and a pass over the nodes for each part
// of a chain of parts.
std::vector<LoosePart> hinged_parts(const Model& model, const std::vector<PrescribedDisplacement>& held);

}  // namespace palpate
