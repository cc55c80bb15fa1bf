// The exterior of a zone, condensed onto the zone's boundary: a multifrontal factor of the organ that leaves
// out the zone.
//
// Divide the organ's nodes into the exterior O, the boundary B that zone and exterior share, and the rest of
// the zone. K is the tangent stiffness of the exterior's elements, and r the forces on their nodes:
//
//   [ K_OO K_OB ] [ du_O ]     [ r_O ]
//   [ K_BO K_BB ] [ du_B ] = - [ r_B ]        (r_B without the zone's elements)
//
// Elimination of O leaves the exterior's stiffness and force as the zone sees them:
//
//   S = K_BB - K_BO K_OO^-1 K_OB,   g = r_B - K_BO K_OO^-1 r_O
//
// The forward substitution maps r to g, and the backward substitution extends du_B to du_O. The pack has the
// tree of fronts (Organ in schemas/pack.fbs). A front eliminates the nodes of its columns and hands an update
// of the nodes below to its parent. Fronts hand nodes of B up without elimination, and the roots to S. At
// rest, a front whose subtree has no node of the zone is the same as in the factor of the whole organ.
//
// Elimination is in float32: S and the substitutions precondition the exterior's iterations (exterior.hpp),
// whose fixed point does not depend on S.
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
  absent       // the rest of the zone; also nodes without a free axis
};

// A front's columns of the Cholesky factor L.
struct FrontFactor {
  const uint32_t* nodes;  // [num_eliminated + num_below] eliminated nodes first
  uint32_t num_eliminated;
  uint32_t num_below;
  uint32_t columns;  // 3 num_eliminated, rounded up to kEliminationColumns with unit pivots
  uint32_t stride;
  float* panel;   // [columns][stride] L11 in the first `columns` rows, then L21
  float* update;  // [3 num_below][3 num_below] lower triangle, column-major; null once the parent has it
};

// Takes memory for front_of[num_free]: the front whose columns hold the node. Constant for a pack.
uint32_t* carve_front_of(const pal_pack& pack, Arena& arena);
// Returns false where the order of the elimination is no permutation.
bool fill_front_of(const pal_pack& pack, uint32_t* front_of);

struct CondensationRoom {  // capacity
  uint32_t kept;           // nodes
  bool keeps_updates;      // updates stay, for other condensations that share the fronts
  size_t nodes;            // entries of all lists of nodes
  size_t panels;           // floats
  size_t updates;          // floats
};

struct Condensation {
  CondensationRoom room;
  uint32_t num_fronts;
  FrontFactor* fronts;  // [num_fronts]
  NodeRole* roles;      // [num_nodes]
  uint8_t* is_own;      // [num_fronts] 1: eliminated here; 0: shared with the whole organ's factor
  uint32_t num_kept;
  uint32_t* kept;         // [room.kept] nodes of B, in the order of S
  uint32_t schur_stride;  // symmetric_stride(3 num_kept)
  float* schur;           // S: [schur_stride][schur_stride], both triangles
  // Memory of the fronts
  uint32_t* nodes;
  float* panels;
  float* updates;
  size_t nodes_used;
  size_t panels_used;
  size_t updates_used;
  // Progress of the elimination
  uint32_t front;
  uint32_t column;    // next column of the front to eliminate
  bool is_assembled;  // the front is in CondensationScratch::matrix
};

// Scratch that all condensations of a session share; only one of them advances at a time.
struct CondensationScratch {
  uint32_t kept;         // capacity, in boundary nodes
  float* matrix;         // [stride] a column: the current front
  uint32_t* unknown_of;  // [num_nodes] the node's first row in the current front, or kNoUnknown
  double* columns;       // [2][columns of the largest front] vectors of eliminated nodes
  double* below;         // [rows below] vector of the nodes below
};

// Returns the room for any zone with at most `kept` boundary nodes; 0: for the whole organ with all updates.
CondensationRoom condensation_room(const pal_pack& pack, uint32_t kept);
void carve_condensation(const pal_pack& pack, const CondensationRoom& room, Arena& arena,
                        Condensation& condensation);
// `kept`: the largest CondensationRoom::kept of the condensations that use the scratch.
void carve_scratch(const pal_pack& pack, uint32_t kept, Arena& arena, CondensationScratch& scratch);
void clear_scratch(const pal_pack& pack, CondensationScratch& scratch);

// Input of a condensation.
struct Exterior {
  const pal_pack& pack;
  const EliminationKernel& kernel;
  const uint32_t* front_of;
  const OrganElements& elements;
  const uint8_t* zone_of_simd_lane;  // [most_simd_lanes()] 0: an exterior element; null: all are exterior
  const double* displacement;        // [num_nodes][3] from the mesh: K is the tangent there
};

// Begins a condensation whose `roles`, `kept` and `num_kept`, within the room, the caller has set. `whole`: the factor of the
// whole organ at the same displacement, which must outlive the shared fronts; null: no front is shared.
void begin_condensation(const Exterior& exterior, const Condensation* whole, CondensationScratch& scratch,
                        Condensation& condensation);

// Advances until `spent` reaches `operations`, multiply-adds. Fails if K_OO is not positive definite, S is
// not finite, or the room does not suffice.
Progress advance_condensation(const Exterior& exterior, uint64_t operations, CondensationScratch& scratch,
                              Condensation& condensation, uint64_t& spent);

// Does the forward substitution of a front, in ascending order of fronts. forces: [num_nodes][3], zero on
// fixed axes. In: r. Out: g on kept nodes, L^-1 r on eliminated nodes. Returns multiply-adds.
uint64_t forward_substitute_front(const Condensation& condensation, const EliminationKernel& kernel,
                                  uint32_t front, CondensationScratch& scratch, double* forces);

// Does the backward substitution of a front, in descending order of fronts. values: [num_nodes][3]. In: du_B
// on kept nodes, -L^-1 r on eliminated nodes. Out: du_O on eliminated nodes. Returns multiply-adds.
uint64_t backward_substitute_front(const Condensation& condensation, const EliminationKernel& kernel,
                                   uint32_t front, CondensationScratch& scratch, double* values);

}  // namespace palpate
