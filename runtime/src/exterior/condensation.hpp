// The exterior of a zone, condensed onto the zone's boundary: a multifrontal factor of the organ that leaves
// out the zone.
//
// Divide the organ's nodes into the exterior O, the boundary B that zone and exterior share, and the rest of the
// zone. With K the tangent stiffness of the exterior's elements and r the forces on their nodes,
//
//   [ K_OO K_OB ] [ du_O ]     [ r_O ]
//   [ K_BO K_BB ] [ du_B ] = - [ r_B ]        (r_B without the zone's elements)
//
// elimination of O leaves the exterior's stiffness and force as the zone sees them:
//
//   S = K_BB - K_BO K_OO^-1 K_OB,   g = r_B - K_BO K_OO^-1 r_O.
//
// The forward substitution maps r to g, and the backward one extends du_B to du_O. The tree of fronts is the
// pack's (Organ in schemas/pack.fbs). A front with a node of B in its columns does not eliminate the node but
// hands the node to its parent; the roots hand B over to S. Fronts whose subtree holds no node of the zone are
// the same in every zone at rest: they are taken from a factor of the whole organ.
//
// Elimination is in float32: S and the substitutions only precondition the exterior's iterations (exterior.hpp),
// whose fixed point does not depend on them.
//
// Source: Duff and Reid 1983, ACM TOMS 9 (multifrontal elimination).
#pragma once

#include "runtime/src/base/progress.hpp"
#include "runtime/src/elements/organ_elements.hpp"
#include "runtime/src/numerics/elimination.hpp"

namespace palpate {

enum class NodeRole : uint8_t {
  eliminated,  // O
  kept,        // B
  absent       // the rest of the zone, and nodes that do not move
};

// A front's part of L: [columns][stride] with L11 on top and L21 below.
struct FrontFactor {
  const uint32_t* nodes;  // the eliminated nodes, then the nodes below
  uint32_t num_eliminated;
  uint32_t num_below;
  uint32_t columns;  // 3 num_eliminated, rounded up to kEliminationColumns with unit pivots
  uint32_t stride;
  float* panel;
  float* update;  // [3 num_below][3 num_below] lower triangle, column-major; null once the parent has it
};

// [num_free] the front that has each node as a column. Constant for a pack.
uint32_t* carve_front_of(const pal_pack& pack, Arena& arena);
// Returns false where the order of the elimination is no permutation.
bool fill_front_of(const pal_pack& pack, uint32_t* front_of);

struct CondensationRoom {  // capacity
  uint32_t kept;           // nodes
  bool keeps_updates;      // for condensations that share the fronts
  size_t nodes;            // entries of all lists of nodes
  size_t panels;           // floats
  size_t updates;          // floats
};

struct Condensation {
  CondensationRoom room;
  uint32_t num_fronts;
  FrontFactor* fronts;  // [num_fronts]
  NodeRole* roles;      // [num_nodes]
  uint8_t* is_own;      // [num_fronts] the front is not the whole organ's
  uint32_t num_kept;
  uint32_t* kept;         // [room.kept] nodes
  uint32_t schur_stride;  // symmetric_stride(3 num_kept)
  float* schur;           // S: [schur_stride][schur_stride], both triangles
  // Memory of the fronts
  uint32_t* nodes;
  float* panels;
  float* updates;
  size_t nodes_used;
  size_t panels_used;
  size_t updates_used;
  // The elimination's state
  uint32_t front;
  uint32_t column;
  bool is_assembled;
};

// What all condensations of a session share; one is advanced at a time.
struct CondensationScratch {
  uint32_t kept;         // its room
  float* matrix;         // the current front
  uint32_t* unknown_of;  // [num_nodes] the node's first row in the current front, or kNoUnknown
  double* columns;       // a front's vector: its columns
  double* below;         // and its rows below
};

// Room for any zone whose boundary has at most `kept` nodes; 0: for the whole organ, which keeps all updates.
CondensationRoom condensation_room(const pal_pack& pack, uint32_t kept);
void carve_condensation(const pal_pack& pack, const CondensationRoom& room, Arena& arena,
                        Condensation& condensation);
// `kept`: the largest room of its condensations.
void carve_scratch(const pal_pack& pack, uint32_t kept, Arena& arena, CondensationScratch& scratch);
void clear_scratch(const pal_pack& pack, CondensationScratch& scratch);

// What a condensation reads. `displacement`: [num_nodes][3] from the mesh, where K is the tangent.
struct Exterior {
  const pal_pack& pack;
  const EliminationKernel& kernel;
  const uint32_t* front_of;
  const OrganElements& elements;
  const uint8_t* zone_of_lane;  // [most_lanes()] elements of zones (organ_elements.hpp); null: none
  const double* displacement;
};

// Begins with Condensation::roles and `kept` set by the caller. `whole`: the factor of the whole organ at the
// same displacements, whose fronts may be shared while it lives; null: none are. Returns false where the kept nodes do not
// fit into the room.
bool begin_condensation(const Exterior& exterior, const Condensation* whole, CondensationScratch& scratch,
                        Condensation& condensation);

// Advances for about so many multiply-adds and adds the work to `spent`. Fails where K_OO is not positive
// definite, or the room does not suffice.
Progress advance_condensation(const Exterior& exterior, uint64_t operations, CondensationScratch& scratch,
                              Condensation& condensation, uint64_t& spent);

// The front's part of the forward substitution; fronts in ascending order. forces: [num_nodes][3]. At the end the kept
// nodes have g, and the eliminated ones L^-1 r, which the backward substitution takes. Forces on fixed axes must be
// zero. Returns multiply-adds.
uint64_t forward_substitute_front(const Condensation& condensation, const EliminationKernel& kernel,
                                  uint32_t front, CondensationScratch& scratch, double* forces);

// The front's part of the backward substitution; fronts in descending order. values: [num_nodes][3]. In: du_B on
// kept nodes, and -L^-1 r on eliminated nodes. Out: du_O on eliminated nodes. Returns multiply-adds.
uint64_t backward_substitute_front(const Condensation& condensation, const EliminationKernel& kernel,
                                   uint32_t front, CondensationScratch& scratch, double* values);

}  // namespace palpate
