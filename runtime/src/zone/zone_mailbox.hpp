// The mailbox between two lanes, neither of which waits. The frames of the haptic lane solve zones. The
// refining lane prepares zones and iterates the exterior.
//
//   idle        no work is under way, or a frame has read the delivery
//   requested   a frame requests an iteration from the state of its zones, or a set of other contacts
//   delivered   the refining lane has finished the work (refinement.hpp)
//
// The refining lane owns request, delivery and the set to prepare in the state `requested`; the haptic lane
// owns them otherwise.
//
// An iteration condenses the exterior's force g and tangent S onto the boundary at w_e. Frames linearise the
// exterior about this state (zone_balance.hpp): a delivery has S_gg, c_g = g_g - S_gg w_g^e and C. Once
// iterations have converged, frames give the solution of the whole organ. Units of the model.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_balance.hpp"
#include "runtime/src/zone/zone_tangent.hpp"

namespace palpate {

// After this number of failed iterations in a row, frames drop the correction, and the lane restarts at rest.
inline constexpr uint32_t kMostFailures = 8;

enum class MailboxState : uint32_t { idle, requested, delivered };

// The state of the active set, and the work that starts from there.
struct ZoneRequest {
  enum class Kind : uint32_t { iterate, prepare } kind;
  uint64_t set;       // ZoneCorrection::number
  uint64_t next_set;  // prepare: number of the requested set
  uint32_t restarts;  // ZoneCorrection::restarts
  bool is_strained;   // the set is not at rest
  uint32_t num_axes;
  double followed[kMostZoneAxes];  // [num_axes] ZoneSet::followed
  double* displacement;            // [max_nodes][3] ZoneSet::displacement
  ZoneMaster* masters;             // [max_masters] ZoneSet::masters
  uint64_t tangent;                // ZoneCorrection::tangent
  uint32_t inclusion_version;
  Inclusion inclusion;
  pal_real* field;  // the field to write, of ZoneMailbox::fields
};

// The result of an iteration, or the exterior at the first state of a prepared set.
struct ZoneDelivery {
  bool is_good;       // the exterior iteration succeeded; else `force`, `energy` and `change` are invalid
  double* force;      // [max_boundary][3] c of the boundary, group by group
  double energy;      // C
  uint64_t tangent;   // number of S
  float* exterior;    // [ZoneRoom::exterior] S of all groups, if `tangent` is not the request's
  double change;      // largest component of the iteration's change of displacements
  bool is_unstable;   // the exterior's tangent near this equilibrium is not positive definite
  bool has_tangents;  // `made` and `tangents` are new
  Tangent made[kMostZoneContacts];  // [groups] state of each group's tangent
  TangentBuffers tangents;
};

// At most six fields are in use: by three snapshots (field_snapshot.hpp), the last delivery, the preparation
// of the set, and the request.
inline constexpr uint32_t kRefinedFields = 6;

struct ZoneMailbox {
  alignas(64) uint32_t state;  // a MailboxState, atomic
  alignas(64) ZoneRequest request;
  ZoneDelivery delivery;
  // The haptic lane owns the members below.
  // [1 + axes][field_size()] displacements of the packed nodes, m, and their derivatives by each axis
  pal_real* fields[kRefinedFields];
  uint32_t field;     // index of the request's field
  uint64_t num_sets;  // number of sets requested so far
};

// Returns the length of a field's displacements, and of its derivative by one axis.
size_t field_size(const pal_pack& pack);

void carve_mailbox(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneMailbox& mailbox);

// Reads and writes ZoneMailbox::state; each lane writes alone what the other lane reads after the change.
bool is_in(const ZoneMailbox& mailbox, MailboxState state);
void set_state(ZoneMailbox& mailbox, MailboxState next);

enum class Taken { none, rejected, taken };

// Reads the delivery of an iteration before a frame is solved. Rejects a delivery for another set, or of a
// contact state that is farther from the present contacts than rest is. Drops a correction of such a state.
Taken take_delivery(const pal_pack& pack, ZoneMailbox& mailbox, ZoneState& state);

// Returns whether a prepared set is delivered, and if so makes the mailbox idle.
bool take_prepared(ZoneMailbox& mailbox);

// Copies c, C and the field of the delivery to the set, which must use the delivery's S. `followed` and
// `displacement`: of ZoneSet, at the delivery's state.
void take_correction(const ZoneMailbox& mailbox, const double* followed, const double* displacement,
                     ZoneFrame& frame);

// Requests an iteration after a frame without a setback, if the mailbox is idle. Requests none if contacts
// stand still and the iterations have converged. `used`: a bit for each field that snapshots use.
void request_iteration(const pal_pack& pack, uint32_t used, ZoneState& state, ZoneMailbox& mailbox);

// Requests the set that ZonePreparation names. Call the function while the mailbox is idle.
void request_set(uint32_t used, ZoneState& state, ZoneMailbox& mailbox);

}  // namespace palpate
