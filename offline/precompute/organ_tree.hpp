// The organ for nonlinear zones: all nodes and elements, and the tree that orders their elimination.
//
// The exterior of a nonlinear zone is the whole organ outside of the zone. The runtime condenses the exterior
// onto the boundary of the zone with a multifrontal factor (runtime/src/exterior/condensation.hpp). The
// fronts come from a symbolic analysis of the graph of nodes. A pack stores the elements front by front.
#pragma once

#include <cstdint>
#include <vector>

#include "offline/precompute/contact_sites.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

struct OrganTree {
  std::vector<int> nodes;  // model nodes: contact nodes in their order, other free nodes, fixed nodes
  int num_free = 0;        // the first num_free nodes are free along some axis and have elements
  std::vector<std::uint32_t> order;  // [num_free] index in `nodes` of each place in the elimination
  std::vector<pack::Front> fronts;   // in postorder
  std::vector<std::uint32_t> rows;   // places of the nodes below each front's columns, ascending in a front
  std::vector<int> elements;         // in Model::elements: front by front, volume patches together
  // [elements] volume patch of each element, numbered from 0 in the order of `elements`, or pack::kNoPatch
  std::vector<std::uint32_t> volume_patches;
};

// Builds the tree. Throws std::runtime_error where the analysis fails, std::bad_alloc where memory runs out.
OrganTree make_organ_tree(const Model& model, const ContactSites& sites);

// Estimates the bytes of the organ's mesh and tree in a pack from counts alone.
double organ_bytes(const Model& model);

}  // namespace palpate
