// The refining lane prepares zones, and brings the exterior, the organ outside of them, to equilibrium with
// the zones that frames solve. A frame requests a new set of contacts or an iteration. Phases:
//
//   begin      chooses the phase that the request needs next
//   whole      factors the whole organ at rest, anew where an inclusion changes it   (condensation.hpp)
//   members    lists the zones of a new set of contacts                              (zone_members.hpp)
//   condense   condenses the exterior onto its boundary, with the tangent at rest    (condensation.hpp)
//   renew      condenses with the tangent at the exterior's displacement
//   evaluate   evaluates the exterior's forces with a new condensation               (exterior.hpp)
//   iterate    does an exterior iteration with the zones of the request
//   tangents   makes the tangents of the groups, for the frames                      (group_tangents.hpp)
//   respond    finds how the field follows the contacts until a delivery             (field_response.hpp)
//
// A new set starts from the current solution: an iteration with the zones of the active set comes first.
// Anderson's acceleration mixes the iterates while the contacts stand still.
//
// The tangent is renewed after two iterations or more, in two cases:
//   - The contacts stand still, and the exterior is near equilibrium but has not converged. The iterations
//     then converge as Newton's method does.
//   - The contacts move and the exterior is far from equilibrium, as in a bar that bends.
//
// An equilibrium whose tangent is not positive definite is unstable, as of a straight column above its
// buckling load. With the tangent at rest the iterations may converge there, so the delivery has
// `is_unstable`.
#pragma once

#include "runtime/src/exterior/acceleration.hpp"
#include "runtime/src/exterior/exterior.hpp"
#include "runtime/src/refining/field_response.hpp"
#include "runtime/src/refining/group_tangents.hpp"
#include "runtime/src/refining/preparation.hpp"
#include "runtime/src/zone/zone_mailbox.hpp"

namespace palpate {

struct IterationHistory {
  uint64_t schur;                // number of S of Refinement::condensation; each new S has a new number
  uint64_t schur_of_groups;      // number of S in the last tangents of the groups; 0: make them anew
  uint32_t iterations_of_schur;  // iterations with this S
  bool is_unstable;              // contacts stand still where the exterior's tangent is not positive definite
  double change;                 // ZoneDelivery::change of the last good iteration
  double unbalanced;             // D of the last iteration (delivery.hpp)
  uint32_t failures;             // failed iterations in a row; the count restarts where D has halved
  double largest_energy;         // largest energy of the exterior after a good iteration
  double followed[kMostZoneAxes];  // contact axes of the last iteration
  uint64_t iterations;             // good iterations of the session
};

struct Refinement {
  ZoneMailbox mailbox;          // shared with frames
  ZonePreparation preparation;  // shared with frames: the state of `mailbox` says who owns its set
  // Data of the refining lane alone
  OrganElements elements;
  uint32_t* front_of;         // [num_free] front whose columns hold the node
  Condensation whole;         // the whole organ, at rest
  Condensation condensation;  // the exterior of `layout`
  CondensationScratch scratch;
  ExteriorState exterior;
  Acceleration acceleration;
  FieldResponse response;
  GroupTangents tangents;
  ZoneLayout layout;
  double* rest;           // [num_nodes][3] displacements at rest, from the mesh
  double* zone;           // [num_nodes][3] from the mesh: the set's displacements on the nodes of its zones
  float* blocks;          // [ZoneRoom::exterior] blocks of S of all groups, from `condensation`
  double* moved;          // [stride of the boundary] scratch: w_e
  double* linear_forces;  // [stride of the boundary] scratch: S w_e
  enum class Phase : uint32_t {
    begin,
    whole,
    members,
    condense,
    renew,
    evaluate,
    tangents,
    iterate,
    respond
  } phase;
  bool is_broken;        // the organ is inconsistent, or cannot be factored at rest: every request fails
  bool has_whole;        // `whole` is a factor for the stiffness of `elements`
  bool is_condensed;     // `condensation` has condensed the exterior of `layout`
  bool starts_strained;  // the new set starts from `exterior`, iterated for the active set; else at rest
  uint32_t inclusion_version;  // ZoneRequest::inclusion_version of the stiffness of `elements`
  IterationHistory history;
};

void carve_refinement(const pal_pack& pack, const ZoneRoom& room, Arena& arena, Refinement& lane);

// Computes the shapes of the organ's elements and the constant tables.
void fill_refinement(const pal_pack& pack, Refinement& lane);

// Result of a slice. failed: an iteration without a good result; delivered: a good iteration, or the end of
// a preparation, even of a refused set.
enum class Refined { nothing, works, failed, delivered };

// Advances the request by about `operations` multiply-adds, in steps of at most a front or a pass over the
// elements. The results have the same bits for any slices. Without a request, factors the whole organ once.
Refined refine(const pal_pack& pack, const EliminationKernel& kernel, uint64_t operations, Refinement& lane);

// Whether a request waits for this lane.
bool has_request(const Refinement& lane);

}  // namespace palpate
