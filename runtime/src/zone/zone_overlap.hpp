// What the fields of contacts and pairs count twice where there are three contacts and more, or something between near
// ones (zone_members.hpp).
//
// The fields of zone_exterior.hpp are of elements outside of zones, but each contact and each pair knows of its own
// zones alone. The elements of a group are nonlinear in full, so that of second order nothing of them may be left
// outside. Of an element e of a group, n2_e its forces, E_c the zone of c, a sum over contacts c > d leaves
//
//   n2_e(U_c x_c, U_d x_d)                     where neither E_c nor E_d holds it
//   (1 - m) n2_e(U_c x_c, U_c x_c) / 2         where m zones hold it and E_c does not: each pair of c with one of those m
//                                              takes it out once; none holds what is between
//
// with U x what a load x does to the linear organ. With s the sum of those over the elements of a group, K the
// organ's stiffness at rest, what has to go is
//
//   dq = K^-1 s,   beyond the boundary B as by forces there   g = T dq_B = s_B - K_BI K_II^-1 s_I,   K and I of the zone alone.
//
// So g moves the zone as forces from outside would, and what the zone does to the rest of the organ
// (ZoneSet::traction) is that much more. Columns of g, for each product of two loads, are made ready with a set. On
// the brain, three contacts far from each other were wrong by up to 1.1 % of |d| without them, in proportion to their
// loads. Energies have w . g / 2 of them, where the elements counted twice store a third of u . s: what that leaves
// is of third order in the loads. Units of the model.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

// Columns of g of so many contacts: for products of the axes u >= v of all loads, at lower_block(u, v).
inline uint32_t num_overlaps(const pal_pack& pack, uint32_t num_contacts) {
  const uint32_t most_without = pack.zone_between ? 1 : 2;
  return pack.num_pair_fields > 0 && num_contacts > most_without
             ? 3 * num_contacts * (3 * num_contacts + 1) / 2
             : 0;
}

// Of a set, once its members are known: none where nodes are fixed while running, as its loads then count as zero, and
// of two contacts with nothing between them.
inline uint32_t num_overlaps(const pal_pack& pack, const ZoneSet& set) {
  const bool is_nothing = !set.follows_series || (set.num_contacts < 3 && set.near == 0);
  return is_nothing ? 0 : num_overlaps(pack, set.num_contacts);
}

inline constexpr uint32_t kMostOverlaps = 3 * kMostZoneContacts * (3 * kMostZoneContacts + 1) / 2;

// Some columns of s, from state.column on, as the last rows of the zone's own stiffness in ZoneState::preparation, in
// which nodes stand as ZoneState::base says and which has `first_row` rows before them. True when it has ended. Cost:
// for each contact as many blocks of the compliance as its patch and the group have nodes; for each column four
// evaluations of the elements that it is of.
bool fill_overlaps(const pal_pack& pack, uint64_t operations, uint32_t first_row, ZoneState& state,
                   ZoneGroup& group, uint64_t& spent);

inline constexpr uint32_t kNoAxis = UINT32_MAX;

// Adds g at the loads of the set to [boundary_stride], or its derivative by axis 3 c + i, of contact c.
void add_overlaps(const pal_pack& pack, const ZoneState& state, const ZoneSet& set, const ZoneGroup& group,
                  uint32_t by_axis, double* forces);

}  // namespace palpate
