// The refining lane: prepares zones, and brings the organ outside of the zone that frames solve to equilibrium, an iteration
// for each request.
//
//   whole       the factor of the whole organ at rest, once, and anew where an inclusion changes its elements
//   prepare     a set of other contacts                                                    (preparation.hpp)
//   condense    the exterior condensed onto the boundary of the set, at rest               (condensation.hpp)
//   iterate     one iteration from where the request's zone is; its result is delivered    (exterior.hpp)
//   renew       the same condensed anew with the tangent where the iterations have got to
//   evaluate    the exterior's forces there
//   tangents    the tangents of the groups, for the frames                                  (group_tangents.hpp)
//   respond     how the field follows the contacts until the next delivery                      (field_response.hpp)
//
// A set is prepared where the organ has got to: one iteration from where the zone of the set before is comes first.
//
// The tangent is renewed after two iterations or more, in two cases:
//   - The contacts stand still, the exterior is near equilibrium and has not converged. The iterations then converge as
//     Newton's method does.
//   - The contacts move and the exterior is far from equilibrium, as in a bar that bends.
//
// An equilibrium whose tangent is not positive definite is unstable, as a straight column under a load that buckles it. The
// iterations may converge to it with the tangent at rest, so the delivery says so.
//
// Anderson's acceleration mixes the iterates where contacts stand still.
#pragma once

#include "runtime/src/exterior/acceleration.hpp"
#include "runtime/src/exterior/exterior.hpp"
#include "runtime/src/refining/field_response.hpp"
#include "runtime/src/refining/group_tangents.hpp"
#include "runtime/src/refining/preparation.hpp"
#include "runtime/src/zone/zone_mailbox.hpp"

namespace palpate {

struct IterationHistory {
  uint64_t tangent;                // number of S of Refinement::own; no two are alike
  uint64_t tangent_of_groups;      // that S is in the tangents of the groups that were made last
  uint32_t iterations_of_tangent;  // since it was condensed
  bool is_unstable;                // the tangent where contacts stand still is not positive definite
  double change;                   // ZoneDelivery::change of the last iteration
  double unbalanced;               // D of the last iteration (delivery.hpp)
  uint32_t failures;               // iterations in a row that were not good and did not halve `unbalanced`
  double largest_energy;           // of the exterior in the good ones
  double followed[kMostZoneAxes];  // of the last request
  uint64_t iterations;
};

struct Refinement {
  ZoneMailbox mailbox;
  ZonePreparation preparation;
  // The refining lane's
  OrganElements elements;
  uint32_t* front_of;
  Condensation whole;
  Condensation own;
  CondensationScratch scratch;
  ExteriorState exterior;
  Acceleration acceleration;
  FieldResponse response;
  GroupTangents tangents;
  ZoneOutline outline;
  double* rest;    // [num_nodes][3] from the mesh
  double* zone;    // [num_nodes][3] the request's displacements, and at rest elsewhere
  float* blocks;   // [ZoneRoom::exterior] S of all groups, of `own` (exterior_size())
  double* moved;   // [stride of the boundary] scratch
  double* forces;  // [stride of the boundary] scratch
  enum class Phase : uint32_t {
    begin,
    whole,
    members,
    rest,
    condense,
    renew,
    evaluate,
    tangents,
    iterate,
    respond
  } phase;
  bool is_broken;  // the organ contradicts itself: nothing good is delivered
  bool has_whole;
  bool has_own;        // the exterior of `outline` is condensed
  bool has_followed;   // an iteration has followed the set before, and the set to be prepared is placed there
  uint32_t inclusion;  // version that `elements` have
  IterationHistory history;
};

void carve_refinement(const pal_pack& pack, const ZoneRoom& room, Arena& arena, Refinement& refinement);

// Computes the shapes of the organ's elements.
void fill_refinement(const pal_pack& pack, Refinement& refinement);

enum class Refined { nothing, works, failed, delivered };

// Works on the request for about so many multiply-adds, in steps of a front or of one pass over the elements; the same bits
// for any slices. `kernel`: the session's. Without a request it factors the whole organ, once.
Refined refine(const pal_pack& pack, const EliminationKernel& kernel, uint64_t operations,
               Refinement& refinement);

// Whether a request waits for this lane.
bool has_request(const Refinement& refinement);

}  // namespace palpate
