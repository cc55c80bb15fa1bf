// Checks that every mesh must pass, whatever its file format.
#pragma once

#include <string>
#include <vector>

#include "offline/mesh/source_place.hpp"

namespace palpate {

// The places of a model's elements in its file, for messages.
struct ModelOrigin {
  SourceFiles files;
  std::vector<Place> elements;
};

// Throws InputError unless, in this order:
//   1. elements exist, and each has a positive volume above rounding,
//   2. no face belongs to three elements, or to two elements on its same side,
//   3. every part is held against rigid motion by Model::fixed, or in a model with steps by each step.
// Appends warnings: unused nodes, parts attached by a corner or an edge, four-node elements that lock.
void check_model(Model& model, const ModelOrigin& origin);

// The checks 1 and 2 of check_model(), for a mesh that has no supports yet.
void check_elements(const Model& model, const ModelOrigin& origin);

// Returns a message for each material that makes tetrahedra of four nodes lock, with the remedy. Elements
// without a material (-1) do not count.
std::vector<std::string> locking_messages(const Model& model);

// Throws InputError at `where` unless `held` holds every part. Where a loose part meets another one without
// common nodes, the message says so and does not advise to hold more.
void check_held(const Model& model, const std::vector<PrescribedDisplacement>& held, const SourceLine& where);

// Returns the signed volume (x1 - x0) . ((x2 - x0) x (x3 - x0)) / 6 of an element's corners, length unit^3.
double signed_volume(const Model& model, const Tetrahedron& element);

// Returns a message for parts that only a corner or an edge attaches, unless `held` stops their rotation;
// empty where there are none. Such a part can turn without a force: check_model() warns, and a build refuses.
std::string hinged_message(const Model& model, const std::vector<PrescribedDisplacement>& held);

}  // namespace palpate
