// What the organ outside of zones adds to its linear answer: displacements q of second and higher orders in the *loads*
// x of the contacts, which a pack carries as fields (offline/precompute/zone_exterior.hpp and zone_mutual.hpp have
// the equations).
//
//   q = sum over contacts c and monomials m_j of degrees 2 .. n  of  m_j(x_c) q_cj
//     + sum over pairs c, d and monomials m_j of x_c, x_d to second or third order (schemas/pair_monomials.hpp) of
//         m_j(x_c, x_d) sum_k (w_cdjk q_ck + w_dcjk q_dk + v_cdjk q_cdk)
//
// which is a sum of columns q_ck of each contact and q_cdk of each pair, times weights that the loads give. Left out
// is what three contacts and more add to each other in the third order, all of higher ones that contacts add to each
// other, and, of contacts one of whose patches reaches into another's zone, all beyond the second: what those have
// alone, what they add to each other and what they and others do, of which parts by themselves are worse than nothing.
// What that counts twice zone_overlap.hpp takes out, to second order. Units of the model.
//
// A load is in units of the site's force_scale. That of a contact alone in its zone is its force, of which the series
// are made; those of neighbours zone_loads.hpp finds.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/numerics/field_kernel.hpp"
#include "runtime/src/zone/field_state.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

inline constexpr uint32_t kMostExteriorColumns =
    kMostZoneContacts * pack::num_monomials(2, pack::kMostZoneDegree) +
    pack::kMostPairFields * kMostZoneContacts * (kMostZoneContacts - 1) / 2;

// Of so many contacts: the columns of each follow one another, then those of pairs c > d, at lower_block(c - 1, d).
uint32_t num_exterior_columns(const pal_pack& pack, uint32_t num_contacts);

// ZoneSet::weights := their weights at the loads of the set, as far as these count: to the length of 2 each, to second
// order of near contacts (ZoneSet::near), to that of pairs of others that share a zone, and not at all with nodes
// fixed while running.
void weigh_exterior(const pal_pack& pack, const ZoneState& state, ZoneSet& set);

// The load of a contact as it counts: no longer than 2, and zero with nodes fixed. Whether it is shortened.
bool load_that_counts(const ZoneSet& set, uint32_t contact, double x[3]);

// Whether the load of a contact is more than the series was made for. What is of second order, as part of a push,
// goes as x^2 / d: more of it than the scene's largest displacement D makes of the contact alone, where x is about
// 1, has x^2 > d / D; among contacts that share a zone, whose loads cancel in part, four times that; of a set of one, which
// a survey knows as far as it stiffens, nine times, and not beside fixed nodes, where no series is used. `largest`:
// displacement of the set, length unit.
bool is_beyond_series(const pal_pack& pack, const ZoneSet& set, uint32_t contact, double largest);

// Whether a set of one contact, within D, is at another root of the series than the organ's, where the organ outside
// would be turned inside out: there x was 4 to 50 sqrt(d / D), d of where it is (or has turned by, times a mean edge), and
// 1.3 at most where an organ of a stiffening law took it. From beyond D such a root is brought along; what gets to 8
// within D cannot be the organ's either.
bool is_at_other_root(const pal_pack& pack, const ZoneSet& set, bool from_beyond);

// Of those weights by the load of one contact; zero where that is too long.
void differentiate_exterior(const pal_pack& pack, const ZoneState& state, const ZoneSet& set,
                            uint32_t contact, double derivatives[3][kMostExteriorColumns]);

// Of t . q, the energy that the organ outside stores beyond t . w / 2, w = C t + b + q, where q goes with that power of
// the tractions: n / (n + 1) of it in all, as Legendre's transform of the energy in t has it.
constexpr double part_beyond_half(uint32_t power) {
  return static_cast<double>(power) / (power + 1) - 0.5;
}

// What each column counts with in that energy.
void weigh_exterior_energy(const pal_pack& pack, const ZoneState& state, const ZoneSet& set, double* parts);

// Adds a group's columns times their weights to [boundary_stride]: ZoneGroup::exterior_fields or exterior_pulls.
void add_exterior_columns(const pal_pack& pack, const ZoneState& state, const ZoneSet& set,
                          const ZoneGroup& group, const float* columns, const double* weights, double* sum);

// One of the columns q on the boundary of a group, and T times it, to which ZoneGroup::exterior_fields and
// exterior_pulls point. False where that does not fit into floats. Cost: boundary_stride^2 multiply-adds.
bool gather_exterior_column(const pal_pack& pack, const ZoneState& state, const ZoneSet& set, uint32_t column,
                            ZoneGroup& group);

// The state of that part of a field.
void fill_exterior_state(const pal_pack& pack, const ZoneState& state, FieldState& field);

// Adds it to the panels first .. first + count - 1 of the field.
void add_exterior_field(const pal_pack& pack, const FieldState& field, uint32_t first, uint32_t count,
                        const FieldKernel& kernel, pal_real* sum);

}  // namespace palpate
