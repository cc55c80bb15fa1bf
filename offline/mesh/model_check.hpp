// The checks that hold for a mesh from any kind of file.
#pragma once

#include <vector>

#include "offline/mesh/source_place.hpp"

namespace palpate {

// Where the elements of a model were said, for messages.
struct ModelOrigin {
  SourceFiles files;
  std::vector<Place> elements;
};

// Throws InputError unless, in this order: there are elements; each has a positive volume that is more than
// rounding; no face belongs to three elements or to two on the same side of it; every part is held against
// its six rigid motions by Model::fixed, or in a model with steps by what each of them prescribes. Appends to
// Model::warnings when nodes belong to no element, elements hang on others by a corner or an edge, or elements
// of four nodes lock.
void check_model(Model& model, const ModelOrigin& origin);

// Throws InputError at `where` unless `held` holds every part.
void check_held(const Model& model, const std::vector<PrescribedDisplacement>& held, const SourceLine& where);

// Signed volume (x1 - x0) . ((x2 - x0) x (x3 - x0)) / 6 of an element, length unit^3.
double signed_volume(const Model& model, const Tetrahedron& element);  // of its corners

// Adds a warning when elements hang on others by a corner or an edge alone, and `held` does not stop them.
void warn_hinged_parts(Model& model, const std::vector<PrescribedDisplacement>& held);

}  // namespace palpate
