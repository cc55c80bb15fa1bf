// How the haptic lane, whose frames solve zones, and the refining lane, which iterates the exterior, pass work to and fro.
//
//   idle        nothing is under way
//   requested   a frame has left where its zone has got to             post_request()
//   delivered   the refining lane has made one iteration from there    refinement.hpp
//   idle        the next frame has read the delivery                   take_delivery()
//
// The refining lane owns request and delivery while the state is `requested`, the haptic lane otherwise. Neither lane waits.
//
// An iteration ends with the exterior's force g and tangent S, condensed onto the boundary at w_e. To frames the exterior
// is linear from there, S (w - w_e) + g = S w + c (ZoneCorrection); a delivery has S and c. Where the iterations have converged,
// the answer is that of the whole organ. Units of the model.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

// Iterations in a row that are not good: frames then go back to first order, and the lane begins anew at rest.
inline constexpr uint32_t kMostFailures = 8;

enum class MailboxState : uint32_t { idle, requested, delivered };

// Where a zone has got to. Nodes and elements are those of the organ (OrganView).
struct ZoneRequest {
  uint64_t set;  // ZoneCorrection::number
  uint32_t restarts;
  uint32_t num_axes;
  double followed[kMostZoneAxes];  // displacements of the contacts, and turns
  uint32_t num_nodes;
  uint32_t* nodes;       // [max_nodes] all of the zone, and those fixed while running
  double* displacement;  // [max_nodes][3] from the mesh
  uint32_t num_elements;
  uint32_t* elements;  // [max_elements]
  uint32_t num_boundary;
  uint32_t* boundary;  // [max_boundary] places in `nodes`: the boundary's nodes that move, group by group
  uint32_t num_groups;
  struct Group {
    uint32_t first_boundary;  // place in `nodes`
    uint32_t num_boundary;
    uint32_t boundary_stride;
  } groups[kMostZoneContacts];
  size_t exterior_size;
  uint64_t tangent;  // ZoneCorrection::tangent
  uint32_t inclusion_version;
  Inclusion inclusion;
  pal_real* field;  // the delivery writes the displacements of the packed nodes here
};

// The result of an iteration.
struct ZoneDelivery {
  bool is_good;      // false: an element outside would be inverted, or the exterior is not positive definite
  double* force;     // [max_boundary][3] c of the boundary's nodes that move
  double* moved;     // [max_boundary][3] w_e, their displacements from rest at the iteration
  double energy;     // C
  uint64_t tangent;  // number of S
  double* exterior;  // [ZoneState::max_exterior] S of all groups, if the request has another one
  double change;     // of displacements by the iteration, the largest component
};

// Three snapshots, the zone and the delivery may each have a field of their own.
inline constexpr uint32_t kRefinedFields = 5;

struct ZoneMailbox {
  alignas(64) uint32_t state;  // a MailboxState, atomic
  alignas(64) ZoneRequest request;
  ZoneDelivery delivery;
  // The haptic lane's
  pal_real* fields[kRefinedFields];  // [row panels of the packed nodes] displacements of all packed nodes: m
  uint32_t field;                    // of the request
};

void carve_mailbox(const pal_pack& pack, const ZoneState& state, Arena& arena, ZoneMailbox& mailbox);

enum class Taken { none, rejected, taken };

// Reads the delivery, if there is one, before a frame is solved. A delivery for other contacts is rejected, as is one from a
// place that is farther from the contacts than rest is. A correction from so far away is dropped.
Taken take_delivery(const pal_pack& pack, ZoneMailbox& mailbox, ZoneState& state);

// After a frame without rejected steps: posts a request, but not where contacts at rest have converged. `used`: a bit for
// each field that snapshots use.
void post_request(const pal_pack& pack, uint32_t used, ZoneState& state, ZoneMailbox& mailbox);

}  // namespace palpate
