// Groups elements that share one volume change, against locking of nearly incompressible tissue.
//
// Linear tetrahedra outnumber nodes about five to one; a volume constraint for each element leaves hardly any
// motion. A patch keeps only its total volume (mean dilatation: Nagtegaal, Parks and Rice 1974; patches: de
// Souza Neto, Andrade Pires and Owen 2005). offline/fem/shared_volumes.hpp has the energy.
#pragma once

#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

// Eight linear tetrahedra share one constraint for two to four nodes, like eight-node bricks with one
// pressure. From six on the result hardly depends on the number (docs/solver_validation.md).
inline constexpr int kElementsPerVolumePatch = 8;

// Sets Tetrahedron::volume_patch, deterministically:
//   a ten-node element of a group other than -1 gets its own number;
//   four-node elements get the number of a compact, face-connected patch of their group.
// Patches up to half of the target size join a neighbour, unless the result reaches three times the target.
void form_volume_patches(Model& model, const std::vector<int>& group_of_element,
                         int elements_per_patch = kElementsPerVolumePatch);

// The number of patches, and the smallest and largest number of elements in a patch.
struct VolumePatchCount {
  int patches = 0;
  int fewest_elements = 0;
  int most_elements = 0;
};
VolumePatchCount count_volume_patches(const Model& model);

// Whether small-strain *ELASTIC elements share volumes. Nonlinear zones do not support such elements.
bool shares_linear_volumes(const Model& model);

}  // namespace palpate
