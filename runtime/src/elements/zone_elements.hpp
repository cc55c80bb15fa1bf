// Nonlinear elements, four at a time (element_batch.hpp): forces, energy and tangent stiffness.
#pragma once

#include <palpate/palpate.h>
#include <stdint.h>

#include "runtime/kernels/element_batch.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

inline constexpr int kMostElementNodes = 10;

// A volume patch: elements that share one volume measure theta (offline/fem/shared_volumes.hpp).
//
// Newton's method has the pressure p as one more unknown, with the equation p = U'(theta(u)). R are the other
// nodal forces, V is the patch's volume, and G = d(V theta)/du. A step (du, dp) solves
//
//   K(u, p) du + G dp = -R - G p,    p + dp = U'(theta) + U'' / V  G . du.
//
// Without dp:  (K(u, p) + U'' / V  G G^T) du = -R - G U'(theta). Only K depends on p, not the solution.
// A step keeps the volume to first order. In nearly incompressible tissue, U' of the second-order rest would
// dominate K(u, U'(theta)); p lacks this rest (Magisano, Leonetti and Garcea 2017, CMAME 313, for stresses).
struct ZonePatch {
  const pack::ZoneMaterial* material;
  uint32_t number;   // OrganElement::volume_patch, in a zone
  double volume;     // V in the mesh, each element's times ZoneLanes::stiffness
  double measure;    // V theta, summed over integration points
  double pressure;   // U'(theta) of the last share_volumes()
  double stiffness;  // U''(theta) / V of the last share_volumes()
  double followed;   // p of Newton's method
  double balanced;   // p at the last equilibrium
  double at_rest;    // p at rest
};

// The data of a batch that are independent of the number of nodes.
struct ZoneLanes {
  const pack::ZoneMaterial* materials[kLanes];
  uint32_t patches[kLanes];  // indices in ZoneBatches::patches, or kNoPatch
  double stiffness[kLanes];  // factor on the material's stiffness
  int count;                 // number of elements; later lanes repeat the last element
};

template <int kNodes>
struct ZoneBatch : ZoneLanes {
  // Nodes are places in the zone's list. The volumes of points are `volumes` times `stiffness`.
  ElementBatch<kNodes> elements;
  std::array<Lanes, ElementBatch<kNodes>::kPoints> volumes;  // of the points in the mesh
};

struct ZoneBatches {
  uint32_t num_linear;
  uint32_t num_quadratic;
  ZoneBatch<4>* linear;
  ZoneBatch<10>* quadratic;
  uint32_t num_patches;
  ZonePatch* patches;    // indexed by ZoneLanes::patches
  uint32_t first_patch;  // the patches of these batches are first_patch .. first_patch + num_patches - 1
  // Selects the elements of one zone. The other elements add nothing.
  struct Kept {
    const uint8_t* of_lane;  // [batches][kLanes] zone number of each element; null: all elements are kept
    uint8_t number;          // of the zone

    bool holds(uint32_t batch, int lane) const {
      return of_lane == nullptr || of_lane[uint32_t{kLanes} * batch + static_cast<uint32_t>(lane)] == number;
    }
    bool holds_any(uint32_t batch) const {
      return holds(batch, 0) || holds(batch, 1) || holds(batch, 2) || holds(batch, 3);
    }
  };
  Kept kept_linear;
  Kept kept_quadratic;
};

static_assert(kLanes == 4);

// Calls work(lanes, corners) for every batch. corners: [4][kLanes], the first rows of ElementBatch::nodes.
template <typename Work>
void for_each_lanes(const ZoneBatches& batches, Work&& work) {
  for (uint32_t n = 0; n < batches.num_linear; ++n)
    work(batches.linear[n], batches.linear[n].elements.nodes.data());
  for (uint32_t n = 0; n < batches.num_quadratic; ++n)
    work(batches.quadratic[n], batches.quadratic[n].elements.nodes.data());
}

// Returns the largest sum over an element's nodes of |dN_a / dX|, in 1 / length. If each node moves by at
// most l, F changes by at most l times this sum.
double steepest_gradient(const ZoneBatches& batches);

// Sets the volumes of all points and patches to the volumes in the mesh times ZoneLanes::stiffness.
void scale_volumes(const ZoneBatches& batches);

// Writes element `index` of a list to its lane and all later lanes of the batch, which later elements
// replace. `place_of`: [nodes of the organ] places in the batches' list; null: the nodes themselves. `patch`:
// its volume patch in `patches`, or kNoPatch. Returns false if the element is inverted in the mesh.
template <int kNodes>
bool append_element(const pal_pack& pack, const pack::OrganElement& element, const uint32_t* place_of,
                    uint32_t patch, uint32_t index, ZonePatch* patches, ZoneBatch<kNodes>* batches);

inline constexpr uint32_t kNoUnknown = UINT32_MAX;        // a fixed node, or a patch that cannot rotate
inline constexpr uint32_t kHeldUnknown = UINT32_MAX - 1;  // a held node: its masters move it

// A contact that moves a held node: by `share` times its displacement, and by `share` times dw x arm for an
// increment dw of its patch rotation (a spin).
struct ZoneMaster {
  uint32_t unknown;  // the first of its three displacements
  uint32_t turn;     // the first of its three spins, or kNoUnknown
  double share;      // 1 / number of contacts that hold the node
  double arm[3];     // from the contact's point to the node, rotated with the patch
};

// The unknowns that move each node of a zone, by their rows in a matrix.
struct ZoneUnknowns {
  const uint32_t* of_place;      // [places] first of three unknowns, or kNoUnknown, kHeldUnknown
  const uint32_t* first_master;  // [places + 1] a held node's first master
  const ZoneMaster* masters;
  const uint32_t* place_of = nullptr;  // [nodes of the batches] places; null: the nodes themselves

  uint32_t place(int node) const {
    return place_of != nullptr ? place_of[node] : static_cast<uint32_t>(node);
  }
};

// The smallest accepted det F. Full solves of crushed tissue reach 1e-3; Newton's iterates need a margin.
inline constexpr double kLeastJacobian = 1e-4;

// Without a positive smallest_jacobian, energy and forces mean nothing.
struct ZoneStrain {
  double energy;             // stored energy of the elements
  double smallest_jacobian;  // smallest det F, small-strain laws excepted; infinite without elements
};

// Adds the nodal forces of all elements to forces[nodes][3]. `displacement`: [nodes][3] from the mesh.
ZoneStrain add_zone_forces(const ZoneBatches& batches, const double* displacement, double* forces);

// Estimates the cost of add_zone_forces(), in multiply-adds.
uint64_t force_operations(const ZoneBatches& batches);

// Estimates the cost of add_zone_stiffness(), in multiply-adds.
uint64_t stiffness_operations(const ZoneBatches& batches);

// Advances ZonePatch::followed by part (U'(theta) - p) + U'' / V  G . (to - from), theta and G at `from`.
// `part`: fraction of a full Newton step; 0: contacts move the zone, without a Newton step.
void follow_pressures(const ZoneBatches& batches, const double* from, const double* to, double part);

// Sets ZonePatch::followed to U'(theta), its value at equilibrium.
void settle_pressures(const ZoneBatches& batches, const double* displacement);

// Adds the tangent stiffness to the lower triangle of a column-major matrix with `stride` floats a column.
void add_zone_stiffness(const ZoneBatches& batches, const double* displacement, const ZoneUnknowns& unknowns,
                        float* matrix, uint32_t stride);

}  // namespace palpate
