// Joins the parts of a mesh that have their own nodes at a common place.
#pragma once

#include <vector>

#include "offline/mesh/model_check.hpp"

namespace palpate {

// Merges nodes of elements that lie closer together than `length` (single linkage) into the first of them, in
// the order of the file. Its place stays. Elements, node sets and labels then name the first node. Appends a
// line to Model::warnings that says how many. Works on a model with nodes, elements and node sets, before its
// loads. Throws InputError where an element would have a node twice.
void merge_nodes(Model& model, double length, const ModelOrigin& origin);

// Takes nodes out of the model. `first`: for each node the node that stands for it, which stands for itself.
// Elements, node sets and labels then name that node.
void replace_nodes(Model& model, const std::vector<int>& first);

}  // namespace palpate
