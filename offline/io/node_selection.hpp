// Chooses nodes by place or by name, for `--fix` and `--probe`:
//
//   z<10%               nodes whose z lies in the lowest tenth of the organ; also x, y, > and a length: z<12.5
//   box x,y,z,x,y,z     nodes in a box between two corners
//   nearest x,y,z,r     the node nearest to a point and all nodes within r of the point
//   NAME                a node set of the model
#pragma once

#include <string>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

// Returns sorted node indices of the model, at least one. Throws std::runtime_error that begins with `option`.
std::vector<int> select_nodes(const Model& model, const std::string& expression, const std::string& option);

}  // namespace palpate
