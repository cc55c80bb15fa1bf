// Elements that share one volume change, so that they do not lock as the tissue becomes incompressible.
//
// A linear tetrahedron has one volume to keep for every third of a node's displacements or so; of elements that all
// must keep theirs hardly a motion is left, and the body comes out too stiff. A patch of several neighbours keeps
// the volume of all of them together (mean dilatation: Nagtegaal, Parks and Rice 1974; for patches of tetrahedra
// de Souza Neto, Andrade Pires and Owen 2005, here in the form of an energy, offline/fem/shared_volumes.hpp).
#pragma once

#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

// With about eight linear tetrahedra to a patch there is one volume to keep for every two to four nodes, as in
// bricks of eight nodes with one pressure; from six on the answer hardly depends on the number (docs/solver_validation.md).
inline constexpr int kElementsPerVolumePatch = 8;

// Sets Tetrahedron::volume_patch: to a number of its own for each element of ten nodes whose group is not -1; for
// those of four nodes to that of a patch, compact and connected by faces, of elements of the same group. Patches of
// up to half as many elements join a neighbour where they have one and do not become thrice as large. The same input
// gives the same patches.
void form_volume_patches(Model& model, const std::vector<int>& group_of_element,
                         int elements_per_patch = kElementsPerVolumePatch);

// Patches of the model and the smallest and largest number of elements in one.
struct VolumePatchCount {
  int patches = 0;
  int fewest_elements = 0;
  int most_elements = 0;
};
VolumePatchCount count_volume_patches(const Model& model);

// Whether elements of *ELASTIC at small strain share their volumes, which nonlinear zones do not know.
bool shares_linear_volumes(const Model& model);

}  // namespace palpate
