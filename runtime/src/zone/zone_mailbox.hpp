// How the haptic lane, whose frames solve zones, and the refining lane, which iterates the exterior, pass work to and fro.
//
//   haptic lane     a frame leaves where its zone has got to, and passes the turn           post_request()
//   refining lane   one iteration of the exterior from there; passes the turn back          refinement.hpp
//   haptic lane     the next frame takes the delivery if the contact set is still the same  take_delivery()
//
// Only the lane whose turn it is reads or writes the request and the delivery. Neither lane waits for the other.
//
// A request names the force s that the exterior has on the boundary in the frame, by the exterior's series. The
// iteration finds the force of the elements themselves at the same displacements. From then on frames add the difference,
// the *correction*: then the answer is that of the whole organ where the iterations have converged, and follows
// the series from there while contacts move. Units of the model.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

enum class LaneTurn : uint32_t { haptic, refining };

// Where a zone has got to. Nodes and elements are those of the organ (OrganView).
struct ZoneRequest {
  uint64_t set;  // ZoneSet::number; 0: no request was posted yet
  uint32_t restarts;
  uint32_t num_axes;
  double followed[kMostZoneAxes];  // displacements of the contacts, and turns
  uint32_t num_nodes;
  uint32_t* nodes;       // [max_nodes]
  double* displacement;  // [max_nodes][3] from the mesh
  uint32_t num_elements;
  uint32_t* elements;  // [max_elements]
  uint32_t num_boundary;
  uint32_t* boundary;  // [max_boundary] places in `nodes`: the boundary's nodes that move
  double* outside;     // [max_boundary][3] s
  double energy;       // of the exterior, as the frame has it
  uint32_t num_fixed;
  uint32_t fixed[kMostZoneFixed];  // nodes fixed while running
  uint32_t inclusion_version;
  Inclusion inclusion;
  pal_real* field;  // where the delivery writes the field
};

// What an iteration found.
struct ZoneDelivery {
  bool is_good;     // false: an element outside was inverted, or the exterior is not positive definite
  double* outside;  // [max_boundary][3] s
  double energy;    // of the exterior
  double change;    // of the exterior's displacements, the largest component
};

// Three snapshots, the zone and the delivery may each have a field of their own.
inline constexpr uint32_t kRefinedFields = 5;

struct ZoneMailbox {
  alignas(64) uint32_t turn;  // a LaneTurn, atomic
  ZoneRequest request;
  ZoneDelivery delivery;
  // The haptic lane's
  pal_real* fields[kRefinedFields];  // [row panels of the packed nodes] displacements of all packed nodes: m
  uint32_t field;                    // of the request
  uint64_t deliveries;               // taken
  uint64_t rejected;
};

void carve_mailbox(const pal_pack& pack, const ZoneState& state, Arena& arena, ZoneMailbox& mailbox);

// Takes a delivery for the active set, if there is one, before a frame is solved. Returns true if the turn came back to this
// lane. `energy_corrected`: what the delivery adds to the stored energy at the contacts' present place.
bool take_delivery(const pal_pack& pack, ZoneMailbox& mailbox, ZoneState& state, double& energy_corrected);

// After a frame: posts a request if the turn is this lane's. `used`: a bit for each field that snapshots use.
void post_request(const pal_pack& pack, uint32_t used, ZoneState& state, ZoneMailbox& mailbox);

}  // namespace palpate
