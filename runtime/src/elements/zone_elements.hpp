// The nonlinear elements of a zone: forces, energy and tangent stiffness, four elements at a time (element_batch.hpp).
#pragma once

#include <palpate/palpate.h>
#include <stdint.h>

#include "runtime/kernels/element_batch.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

inline constexpr int kMostElementNodes = 10;

// A volume patch that a zone holds: offline/fem/shared_volumes.hpp has the equations.
//
// Newton takes its pressure p as an unknown of its own, of one more equation, p = U'(theta(u)). With R the forces of
// the other terms and G = d(V theta)/du, a step has
//
//   K(u, p) du + G dp = -R - G p,    p + dp = U'(theta) + U'' / V  G . du
//
// and without dp that is (K(u, p) + U'' / V  G G^T) du = -R - G U'(theta): the forces are those of the displacements
// alone, and so is what the steps lead to, but K is of a p that follows them to first order. Steps keep volumes no
// better than that, and where tissue is nearly incompressible U' of what is left of second order outweighs all else
// (Magisano, Leonetti and Garcea 2017, CMAME 313, for stresses).
struct ZonePatch {
  const pack::ZoneMaterial* material;
  uint32_t number;   // OrganElement::volume_patch
  double volume;     // in the mesh
  double measure;    // sum of V theta
  double pressure;   // U' of it
  double stiffness;  // U'' / volume
  double followed;   // p
  double balanced;   // p when the zone was in balance last
  double at_rest;    // p
};

// What a batch knows of its elements whatever their kind.
struct ZoneLanes {
  const pack::ZoneMaterial* materials[kLanes];
  uint32_t patches[kLanes];  // of ZoneBatches, or kNoPatch
  double stiffness[kLanes];  // times that of the material
  int count;                 // the lanes after them repeat the last one
};

template <int kNodes>
struct ZoneBatch : ZoneLanes {
  ElementBatch<kNodes> elements;  // nodes: places in the zone's list
  // What the points of `elements` stand for in the mesh, there times `stiffness`
  std::array<Lanes, ElementBatch<kNodes>::kPoints> volumes;
};

struct ZoneBatches {
  uint32_t num_linear;
  uint32_t num_quadratic;
  ZoneBatch<4>* linear;
  ZoneBatch<10>* quadratic;
  uint32_t num_patches;
  ZonePatch* patches;    // by ZoneLanes::patches
  uint32_t first_patch;  // the patches of these batches are first_patch .. first_patch + num_patches - 1
  // Elements whose lane has another number than `number` are left out, as if they were not there
  struct Kept {
    const uint8_t* of_lane;  // null: none is left out
    uint8_t number;

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

// Calls work(lanes, corners) of every batch; corners[4][kLanes] as ElementBatch::nodes.
template <typename Work>
void for_each_lanes(const ZoneBatches& batches, Work&& work) {
  for (uint32_t n = 0; n < batches.num_linear; ++n)
    work(batches.linear[n], batches.linear[n].elements.nodes.data());
  for (uint32_t n = 0; n < batches.num_quadratic; ++n)
    work(batches.quadratic[n], batches.quadratic[n].elements.nodes.data());
}

// Forces and stiffness may be those of one part after the other: of a batch each or, where they share volumes, of all.
uint32_t num_parts(const ZoneBatches& batches);
ZoneBatches part_of(const ZoneBatches& batches, uint32_t part);

// The largest sum over an element's nodes of |dN_a / dX|, 1 / length. Where each node moves by less than a length, F changes by
// at most the length times this.
double steepest_gradient(const ZoneBatches& batches);

// Makes of all points and patches what they are in the mesh, times ZoneLanes::stiffness.
void scale_volumes(const ZoneBatches& batches);

// Puts element `index` of a list in its lane, and in all lanes after it, which the next elements overwrite: the shape
// gradients of its geometry in the mesh. `place_of`: [nodes of the organ] their places in the list of the batches; null:
// the nodes themselves. `patch`: its volume patch in `patches`, or kNoPatch. Returns false where the element is inverted.
template <int kNodes>
bool append_element(const pal_pack& pack, const pack::OrganElement& element, const uint32_t* place_of,
                    uint32_t patch, uint32_t index, ZonePatch* patches, ZoneBatch<kNodes>* batches);

// Where the unknowns of a zone stand in a matrix. A node that contacts hold is a mean of their displacements; where a
// patch turns, an increment dw of its rotation (a spin) moves the node by dw x arm.
inline constexpr uint32_t kNoUnknown = UINT32_MAX;        // fixed
inline constexpr uint32_t kHeldUnknown = UINT32_MAX - 1;  // see its masters

struct ZoneMaster {
  uint32_t unknown;  // the first of three, of its displacement
  uint32_t turn;     // and of its rotation, or kNoUnknown
  double share;
  double arm[3];  // from the contact's point, turned
};

struct ZoneUnknowns {
  const uint32_t* of_place;      // the first of three, or kNoUnknown, kHeldUnknown
  const uint32_t* first_master;  // of those held
  const ZoneMaster* masters;
  const uint32_t* place_of =
      nullptr;  // [nodes of the batches] places in the arrays; null: the nodes themselves

  uint32_t place(int node) const {
    return place_of != nullptr ? place_of[node] : static_cast<uint32_t>(node);
  }
};

// The least det F of an accepted element. Full solves of crushed tissue reach 1e-3; Newton's iterates need more room.
inline constexpr double kLeastJacobian = 1e-4;

struct ZoneStrain {
  double energy;
  // det F, but of small strains; where it is not positive, energy and forces mean nothing. Infinite if there is none
  double smallest_jacobian;
};

// Adds the nodal forces of all elements to forces[nodes][3], at these displacements from the mesh, [nodes][3].
ZoneStrain add_zone_forces(const ZoneBatches& batches, const double* displacement, double* forces);

// Multiply-adds that take about as long.
uint64_t force_operations(const ZoneBatches& batches);

// The same, of add_zone_stiffness().
uint64_t stiffness_operations(const ZoneBatches& batches);

// ZonePatch::followed after a step between two states, by its equation above. `part`: how much of the Newton step it
// is, 0 where it only follows what moves the zone. The patches' other numbers are then those of `from`.
void follow_pressures(const ZoneBatches& batches, const double* from, const double* to, double part);

// ZonePatch::followed of patches in balance.
void settle_pressures(const ZoneBatches& batches, const double* displacement);

// Adds the tangent stiffness to the lower triangle of a column-major matrix.
void add_zone_stiffness(const ZoneBatches& batches, const double* displacement, const ZoneUnknowns& unknowns,
                        float* matrix, uint32_t stride);

}  // namespace palpate
