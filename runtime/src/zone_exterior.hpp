// What the organ outside of zones adds to its linear answer: displacements q of second and third order in the net forces f of
// the contacts, which a pack carries as fields (offline/precompute/zone_exterior.hpp and zone_mutual.hpp have the equations).
//
//   q = sum over contacts c and monomials m_j of degrees 2 and 3 of  m_j(x_c) q_cj           x_c = f_c / force_scale
//     + sum over pairs c, d and quadratic monomials m_j of x_c, x_d of  m_j(x_c, x_d) sum_k w_cdjk p_k   p a basis
//
// which is a sum of columns, 16 for each contact and those of p, times weights that the forces give. Left out is what
// contacts add to each other in the third order. Units of the model.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/field_kernel.hpp"
#include "runtime/src/field_snapshot.hpp"
#include "runtime/src/zone_set.hpp"

namespace palpate {

inline constexpr uint32_t kMostExteriorColumns = kMostZoneContacts * pack::kZoneColumns + pack::kMostMutual;

// Of so many contacts.
uint32_t num_exterior_columns(const pal_pack& pack, uint32_t num_contacts);

// ZoneSet::weights := their weights at the forces of the set. Those of several contacts that are larger than the pushes warrant count the
// less the larger they are: the answer tends to that of first order outside.
void weigh_exterior(const pal_pack& pack, uint32_t rings, ZoneSet& set);

// Whether a contact bears more than the series was made for. What is of second order, as part of a push, goes as f^2 / d:
// more of it than the scene's largest displacement D makes of the contact alone, whose force there is F, has
// (f / F)^2 > d / D. So neighbours that pull against each other are beyond it even where they hardly move. `largest`:
// displacement of the set, length unit.
bool is_beyond_series(const pal_pack& pack, const ZoneSet& set, uint32_t contact, double largest);

// Of those weights by the force of one contact; zero where that has been shortened.
void differentiate_exterior(const pal_pack& pack, const ZoneSet& set, uint32_t rings, uint32_t contact,
                            double derivatives[3][kMostExteriorColumns]);

// 2 or 3, of a column's weight in the forces.
uint32_t exterior_degree(const ZoneSet& set, uint32_t column);

// The columns q on the boundary of a group, and T q, to which ZoneGroup::exterior_fields and exterior_pulls point.
void gather_exterior(const pal_pack& pack, const ZoneState& state, const ZoneSet& set, ZoneGroup& group);

// The state of that part of a field.
void fill_exterior_state(const pal_pack& pack, const ZoneState& state, FieldState& field);

// Adds it to the panels first .. first + count - 1 of the field.
void add_exterior_field(const pal_pack& pack, const FieldState& field, uint32_t first, uint32_t count,
                        AddColumns add_columns, pal_real* sum);

}  // namespace palpate
