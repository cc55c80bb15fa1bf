// How the haptic lane, whose frames solve zones, and the refining lane, which prepares zones and iterates the exterior, pass
// work to and fro.
//
//   idle        nothing is under way
//   requested   a frame asks for an iteration from where its zone has got to, or for a set of other contacts
//   delivered   the refining lane has done so                                                  (refinement.hpp)
//   idle        the next frame has read the delivery
//
// The refining lane owns request, delivery and the set to prepare while the state is `requested`, the haptic lane otherwise.
// Neither lane waits.
//
// An iteration ends with the exterior's force g and tangent S, condensed onto the boundary at w_e. To frames the exterior
// is linear from there (zone_balance.hpp); a delivery has S_gg, c_g = g_g - S_gg w_g^e and C. Where the iterations have
// converged, the answer is that of the whole organ. Units of the model.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_balance.hpp"
#include "runtime/src/zone/zone_tangent.hpp"

namespace palpate {

// Iterations in a row that are not good: frames then go back to first order, and the lane begins anew at rest.
inline constexpr uint32_t kMostFailures = 8;

enum class MailboxState : uint32_t { idle, requested, delivered };

// The state of the active set, and the work that starts from there.
struct ZoneRequest {
  enum class Kind : uint32_t { iterate, prepare } kind;
  uint64_t set;       // ZoneCorrection::number
  uint64_t next_set;  // prepare: the number of the set to come
  uint32_t restarts;
  bool is_strained;  // else the set is at rest
  uint32_t num_axes;
  double followed[kMostZoneAxes];  // displacements of the contacts, and turns
  double* displacement;            // [max_nodes][3] from the mesh
  ZoneMaster* masters;             // [max_masters]
  uint64_t tangent;                // ZoneCorrection::tangent
  uint32_t inclusion_version;
  Inclusion inclusion;
  pal_real* field;  // for the delivery (ZoneMailbox::fields)
};

// The result of an iteration, or the exterior of a prepared set where its nodes have been placed.
struct ZoneDelivery {
  bool is_good;       // false: an element outside would be inverted, or the exterior is not positive definite
  double* force;      // [max_boundary][3], rounded to a stride: c of the boundary, group by group
  double energy;      // C
  uint64_t tangent;   // number of S
  float* exterior;    // [ZoneRoom::exterior] S of all groups, if the active set has another one
  double change;      // of displacements by the iteration, the largest component
  bool is_unstable;   // the exterior's tangent near this equilibrium is not positive definite
  bool has_tangents;  // of the groups, at the request's displacements or of the prepared set
  Tangent made[kMostZoneContacts];
  TangentBuffers tangents;
};

// Three snapshots, the zone's last and first ones, and the delivery may each have a field of their own.
inline constexpr uint32_t kRefinedFields = 6;

struct ZoneMailbox {
  alignas(64) uint32_t state;  // a MailboxState, atomic
  alignas(64) ZoneRequest request;
  ZoneDelivery delivery;
  // The haptic lane's
  // [1 + axes][row panels of the packed nodes] displacements of all packed nodes, m, and their derivatives by each axis
  pal_real* fields[kRefinedFields];
  uint32_t field;     // of the request
  uint64_t num_sets;  // requested so far
};

// Numbers of a field's displacements, and of its derivative by an axis.
size_t field_size(const pal_pack& pack);

void carve_mailbox(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneMailbox& mailbox);

bool is_idle(const ZoneMailbox& mailbox);

enum class Taken { none, rejected, taken };

// Reads the delivery of an iteration, if there is one, before a frame is solved. A delivery for other contacts is rejected,
// as is one from a place that is farther from the contacts than rest is. A correction from so far away is dropped.
Taken take_delivery(const pal_pack& pack, ZoneMailbox& mailbox, ZoneState& state);

// Whether a prepared set is delivered. The mailbox is idle then.
bool take_prepared(ZoneMailbox& mailbox);

// c, C and the field of the delivery become those of the set, whose S the delivery belongs to. `followed` and
// `displacement`: ZoneSet's where the delivery was computed.
void take_correction(const ZoneMailbox& mailbox, const double* followed, const double* displacement,
                     ZoneFrame& frame);

// After a frame without rejected steps: requests an iteration, but not where contacts at rest have converged, nor while the
// mailbox is not idle. `used`: a bit for each field that snapshots use.
void request_iteration(const pal_pack& pack, uint32_t used, ZoneState& state, ZoneMailbox& mailbox);

// Requests the set that the preparation names. Call it while the mailbox is idle.
void request_set(uint32_t used, ZoneState& state, ZoneMailbox& mailbox);

}  // namespace palpate
