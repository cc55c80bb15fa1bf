// What the organ outside of a zone adds to its linear answer: displacements q of second and third order in the net force f
// of each contact, which a pack carries as fields (offline/precompute/zone_exterior.hpp has the equations).
//
//   q(f) = sum over monomials m_j of degrees 2 and 3 of m_j(x) q_j,   x = f / force_scale of the contact's site
//
// Contacts add up, each with the fields of its own zone: what their fields do to each other is left out, as is that
// elements outside of one's zone may be inside another's.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/field_kernel.hpp"
#include "runtime/src/field_snapshot.hpp"
#include "runtime/src/zone_set.hpp"

namespace palpate {

// The monomials at a contact's force in the set, which is shortened to what the series is good for.
void weigh_exterior(const pal_pack& pack, const ZoneSet& set, uint32_t contact,
                    double weights[pack::kZoneColumns]);

// Of those monomials by the contact's force; zero where that has been shortened.
void differentiate_exterior(const pal_pack& pack, const ZoneSet& set, uint32_t contact,
                            double derivatives[3][pack::kZoneColumns]);

// q_j of every contact on the boundary of a group, and T q_j, to which ZoneGroup::exterior_fields points.
void gather_exterior(const pal_pack& pack, const ZoneState& state, const ZoneSet& set, ZoneGroup& group);

// Adds q of the contacts of a frame to the panels first .. first + count - 1 of its field.
void add_exterior_field(const pal_pack& pack, const FieldState& field, uint32_t first, uint32_t count,
                        AddColumns add_columns, pal_real* sum);

}  // namespace palpate
