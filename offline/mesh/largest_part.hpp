// Drops every part of a mesh but the largest one.
#pragma once

#include "offline/mesh/model.hpp"

namespace palpate {

// Keeps the part (connected_parts() of rigid_motion.hpp) with the most elements, or the first of equal ones.
// Nodes, sets, labels and supports of the others go with their elements, and Model::warnings says how many.
// Works on a model without steps.
void keep_largest_part(Model& model);

}  // namespace palpate
