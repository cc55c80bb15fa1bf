#include "runtime/src/zone/zone_exterior.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/numerics/basis_combination.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "schemas/pair_monomials.hpp"

namespace palpate {
namespace {

constexpr uint32_t kFirst = pack::monomial_start(2);
constexpr uint32_t kMostMonomials = pack::monomial_start(pack::kMostZoneDegree + 1);

// A panel of these columns, of a site outside of so many rings.
const unsigned char* panel_of_site(const pal_pack& pack, uint32_t rings, uint32_t site, uint32_t panel) {
  const uint64_t index = (uint64_t{rings - 1} * pack.num_sites + site) * pack.num_row_panels + panel;
  return pack.zone_exterior + index * pack::field_panel_bytes(pack.zone_columns, pack.zone_rounded);
}

double unit_of_column(const pal_pack& pack, uint32_t rings, uint32_t site, uint32_t column) {
  const uint64_t first = (uint64_t{rings - 1} * pack.num_sites + site) * pack.zone_columns;
  return pack.zone_exterior_units[first + column];
}

// Of one of its columns.
double entry_of_site(const pal_pack& pack, uint32_t rings, uint32_t site, uint32_t column, uint32_t row) {
  const unsigned char* panel = panel_of_site(pack, rings, site, row / pack::kPanelRows);
  row %= pack::kPanelRows;
  const double part =
      pack.zone_rounded
          ? static_cast<double>(reinterpret_cast<const int16_t*>(panel)[pack::rounded_place(column, row)]) /
                pack::kBasisUnit
          : static_cast<double>(reinterpret_cast<const pal_real*>(panel)[column * pack::kPanelRows + row]);
  return unit_of_column(pack, rings, site, column) * part;
}

// Of two sites that are not the same.
uint64_t pair_of_sites(uint32_t site, uint32_t other) {
  return site > other ? pack::lower_block(site - 1, other) : pack::lower_block(other - 1, site);
}

// A panel of the pair's own columns.
const int8_t* panel_of_pair(const pal_pack& pack, uint32_t site, uint32_t other, uint32_t panel) {
  const uint64_t index = pair_of_sites(site, other) * pack.num_row_panels + panel;
  return pack.pair_fields + index * pack.num_pair_fields * pack::kPanelRows;
}

// Of the pair's columns, in the order of num_exterior_columns().
uint32_t first_column_of_pair(const pal_pack& pack, uint32_t num_contacts, uint32_t contact, uint32_t other) {
  const auto pair = static_cast<uint32_t>(contact > other ? pack::lower_block(contact - 1, other)
                                                          : pack::lower_block(other - 1, contact));
  return num_contacts * pack.zone_columns + pair * pack.num_pair_fields;
}

double square_of(const double v[3]) {
  return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}

// How long loads may be; a longer one counts as one of this length in its direction. Within the scene's largest
// displacement that of a contact alone stays about 1.
constexpr double kFarthest = 2;
constexpr double kMostOfOne = 3;  // x of a set of one contact, in units of sqrt(d / D)

// Forces that fix nodes have a part in what leaves the zone, and of those no series is known.
double reach_of(const ZoneSet& set) {
  return set.follows_series ? kFarthest : 0;
}

// To which degree a contact's own load counts. Near ones, whose loads may nearly cancel, have to second order what
// they add, alone and together: higher ones are those of forces, which such loads no longer are. Others that share a
// zone have no more than they add to each other.
uint32_t own_degree(const pal_pack& pack, const ZoneSet& set, uint32_t contact) {
  if (is_near(set, contact)) return 2;
  if (is_alone_in_zone(set, contact)) return pack.zone_degree;
  return pack.num_pair_fields > 0 ? pack.pair_degree : 2;
}

// A load of the set as it counts.
struct Load {
  double x[3];
  bool is_shortened;
};

Load load_of(const ZoneSet& set, uint32_t contact) {
  const double reach = reach_of(set);
  Load load = {{}, false};
  memcpy(load.x, set.loads + size_t{3} * contact, sizeof load.x);
  const double length = sqrt(square_of(load.x));
  if (length > reach) {
    for (double& x : load.x) x *= reach / length;
    load.is_shortened = true;
  }
  return load;
}

// The monomials of a load to the degree of what pairs add, or their derivatives by one of its components.
using PairFactors = double[pack::monomial_start(pack::kMostPairDegree + 1)];

void evaluate_factors(const pal_pack& pack, const Load& load, PairFactors& factors) {
  pack::evaluate_monomials(load.x, pack.pair_degree, factors);
}

void differentiate_factors(const pal_pack& pack, const double* of, uint32_t axis, PairFactors& derivatives) {
  pack::for_each_monomial(pack.pair_degree, [&](uint32_t index, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t powers[3] = {a, b, c};
    derivatives[index] = 0;
    if (powers[axis] == 0) return;
    const double power = powers[axis]--;
    derivatives[index] = power * of[pack::monomial_index(powers[0], powers[1], powers[2])];
  });
}

// Of the columns of a contact's site, those that weigh anything: its own monomials, and what pairs take part in.
uint32_t columns_in_use(const pal_pack& pack, const ZoneSet& set, uint32_t contact) {
  const uint32_t own = pack::num_monomials(2, own_degree(pack, set, contact));
  return pack.num_pair_fields > 0 ? std::max(own, pack::kPairColumns) : own;
}

// Adds what two contacts weigh the fields of both with, by their monomials `from` and on: those are products of what
// `of_contact` and `of_other` hold.
void add_pair(const pal_pack& pack, const ZoneState& state, const ZoneSet& set, uint32_t contact,
              uint32_t other, const PairFactors& of_contact, const PairFactors& of_other, uint32_t from,
              double scale, double* weights) {
  const uint32_t site = set.sites[contact];
  const uint32_t site_of_other = set.sites[other];
  if (site == site_of_other) return;
  const bool is_first = site > site_of_other;
  const uint64_t pairs = uint64_t{pack.num_sites} * (pack.num_sites - 1) / 2;
  const uint32_t of_monomial = 2 * pack::kPairColumns + pack.num_pair_fields;
  const uint32_t num_monomials = pack::num_pair_monomials(pack.pair_degree);
  const bool is_any_near = is_near(set, contact) || is_near(set, other);
  const uint32_t to = is_any_near ? pack::num_pair_monomials(2) : num_monomials;
  if (from >= to) return;
  const PairFactors& x = is_first ? of_contact : of_other;
  const PairFactors& y = is_first ? of_other : of_contact;
  double products[pack::num_pair_monomials(pack::kMostPairDegree)];
  for (uint32_t i = from; i < to; ++i)
    products[i] = scale * x[pack::kPairMonomials[i].of_x] * y[pack::kPairMonomials[i].of_y];
  const float* of_pair =
      pack.pair_weights +
      ((uint64_t{state.rings - 1} * pairs + pair_of_sites(site, site_of_other)) * num_monomials + from) *
          of_monomial;
  alignas(32) double sums[2 * pack::kPairColumns + pack::kMostPairFields] = {};
  state.kernel.add_float_product(of_pair, of_monomial, of_monomial, to - from, products + from, sums);
  double* of_first = weights + size_t{is_first ? contact : other} * pack.zone_columns;
  double* of_second = weights + size_t{is_first ? other : contact} * pack.zone_columns;
  double* of_both = weights + first_column_of_pair(pack, set.num_contacts, contact, other);
  for (uint32_t k = 0; k < pack::kPairColumns; ++k) {
    of_first[k] += sums[k];
    of_second[k] += sums[pack::kPairColumns + k];
  }
  for (uint32_t k = 0; k < pack.num_pair_fields; ++k) of_both[k] += sums[2 * pack::kPairColumns + k];
}

// The same of all pairs of the set.
void add_pairs(const pal_pack& pack, const ZoneState& state, const ZoneSet& set, uint32_t from, double scale,
               double* weights) {
  if (pack.num_pair_fields == 0) return;
  PairFactors factors[kMostZoneContacts];
  for (uint32_t c = 0; c < set.num_contacts; ++c) {
    evaluate_factors(pack, load_of(set, c), factors[c]);
    for (uint32_t other = 0; other < c; ++other)
      add_pair(pack, state, set, c, other, factors[c], factors[other], from, scale, weights);
  }
}

// Whether x^2 is more than so many d / D.
bool has_square_beyond(const pal_pack& pack, const ZoneSet& set, uint32_t contact, double d, double most) {
  constexpr double kAtRest = 1e-6;  // of D: what a load is then may be left of a longer way
  const double part = std::max(kAtRest, std::min(1.0, d / pack.max_displacement));
  return square_of(set.loads + size_t{3} * contact) > most * part;
}

}  // namespace

uint32_t num_exterior_columns(const pal_pack& pack, uint32_t num_contacts) {
  return num_contacts * pack.zone_columns + num_contacts * (num_contacts - 1) / 2 * pack.num_pair_fields;
}

void weigh_exterior(const pal_pack& pack, const ZoneState& state, ZoneSet& set) {
  memset(set.weights, 0, num_exterior_columns(pack, set.num_contacts) * sizeof *set.weights);
  for (uint32_t c = 0; c < set.num_contacts; ++c) {
    double monomials[kMostMonomials];
    const uint32_t degree = own_degree(pack, set, c);
    pack::evaluate_monomials(load_of(set, c).x, degree, monomials);
    for (uint32_t j = 0; j < pack::num_monomials(2, degree); ++j)
      set.weights[size_t{c} * pack.zone_columns + j] += monomials[kFirst + j];
  }
  add_pairs(pack, state, set, 0, 1.0, set.weights);
}

void weigh_exterior_energy(const pal_pack& pack, const ZoneState& state, const ZoneSet& set, double* parts) {
  const uint32_t columns = num_exterior_columns(pack, set.num_contacts);
  for (uint32_t j = 0; j < columns; ++j) parts[j] = part_beyond_half(2) * set.weights[j];
  for (uint32_t c = 0; c < set.num_contacts; ++c) {
    double monomials[kMostMonomials];
    const uint32_t own = own_degree(pack, set, c);
    pack::evaluate_monomials(load_of(set, c).x, own, monomials);
    for (uint32_t degree = 3; degree <= own; ++degree) {
      for (uint32_t j = pack::monomial_start(degree); j < pack::monomial_start(degree + 1); ++j)
        parts[c * pack.zone_columns + j - kFirst] +=
            (part_beyond_half(degree) - part_beyond_half(2)) * monomials[j];
    }
  }
  add_pairs(pack, state, set, pack::num_pair_monomials(2), part_beyond_half(3) - part_beyond_half(2), parts);
}

void add_exterior_columns(const pal_pack& pack, const ZoneState& state, const ZoneSet& set,
                          const ZoneGroup& group, const float* columns, const double* weights, double* sum) {
  const uint32_t stride = group.boundary_stride;
  const auto add = [&](uint32_t first, uint32_t count) {
    state.kernel.add_float_product(columns + size_t{first} * stride, stride, stride, count, weights + first,
                                   sum);
  };
  for (uint32_t c = 0; c < set.num_contacts; ++c) add(c * pack.zone_columns, columns_in_use(pack, set, c));
  const uint32_t of_contacts = set.num_contacts * pack.zone_columns;
  add(of_contacts, num_exterior_columns(pack, set.num_contacts) - of_contacts);
}

bool load_that_counts(const ZoneSet& set, uint32_t contact, double x[3]) {
  const Load load = load_of(set, contact);
  memcpy(x, load.x, sizeof load.x);
  return load.is_shortened;
}

bool is_beyond_series(const pal_pack& pack, const ZoneSet& set, uint32_t contact, double largest) {
  if (set.num_contacts == 1)
    return set.follows_series && has_square_beyond(pack, set, contact, largest, kMostOfOne * kMostOfOne);
  return has_square_beyond(pack, set, contact, largest,
                           is_alone_in_zone(set, contact) ? 1 : kFarthest * kFarthest);
}

bool is_at_other_root(const pal_pack& pack, const ZoneSet& set, bool from_beyond) {
  constexpr double kMostWithin = 8;
  if (set.num_contacts != 1 || !set.follows_series) return false;
  const double turned = set.num_axes > 3 ? pack.mean_surface_edge * sqrt(square_of(set.followed + 3)) : 0;
  const double moved = std::max(turned, sqrt(square_of(set.followed)));
  const double most = from_beyond ? kMostOfOne : kMostWithin;
  return moved <= pack.max_displacement && has_square_beyond(pack, set, 0, moved, most * most);
}

void differentiate_exterior(const pal_pack& pack, const ZoneState& state, const ZoneSet& set,
                            uint32_t contact, double derivatives[3][kMostExteriorColumns]) {
  const Load load = load_of(set, contact);
  const uint32_t degree = own_degree(pack, set, contact);
  double monomials[kMostMonomials];
  pack::evaluate_monomials(load.x, std::max(degree, pack.pair_degree), monomials);
  PairFactors of_others[kMostZoneContacts];
  for (uint32_t other = 0; other < set.num_contacts; ++other)
    evaluate_factors(pack, load_of(set, other), of_others[other]);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    double* by_axis = derivatives[axis];
    memset(by_axis, 0, num_exterior_columns(pack, set.num_contacts) * sizeof *by_axis);
    if (load.is_shortened) continue;
    double* own = by_axis + size_t{contact} * pack.zone_columns;
    pack::for_each_monomial(degree, [&](uint32_t index, uint32_t a, uint32_t b, uint32_t c) {
      uint32_t powers[3] = {a, b, c};
      if (index < kFirst || powers[axis] == 0) return;
      const double power = powers[axis]--;
      own[index - kFirst] = power * monomials[pack::monomial_index(powers[0], powers[1], powers[2])];
    });
    for (uint32_t other = 0; other < set.num_contacts && pack.num_pair_fields > 0; ++other) {
      if (other == contact) continue;
      PairFactors factors;
      differentiate_factors(pack, monomials, axis, factors);
      add_pair(pack, state, set, contact, other, factors, of_others[other], 0, 1.0, by_axis);
    }
  }
}

bool gather_exterior_column(const pal_pack& pack, const ZoneState& state, const ZoneSet& set, uint32_t column,
                            ZoneGroup& group) {
  constexpr double kLargest = 1e38;
  const size_t stride = group.boundary_stride;
  const uint32_t of_contacts = set.num_contacts * pack.zone_columns;
  const bool is_own = column < of_contacts;
  uint32_t contact = column / pack.zone_columns;
  uint32_t other = 0;
  if (!is_own) {
    pack::find_lower_block((column - of_contacts) / pack.num_pair_fields, contact, other);
    ++contact;
  }
  const bool is_nothing = !is_own && set.sites[contact] == set.sites[other];
  const uint32_t place = is_own ? column % pack.zone_columns : (column - of_contacts) % pack.num_pair_fields;
  double* field = state.boundary;
  double* pull = state.vector;
  memset(field, 0, stride * sizeof *field);
  memset(pull, 0, stride * sizeof *pull);
  for (uint32_t b = 0; b < group.num_boundary && !is_nothing; ++b) {
    const uint32_t row = pack.zone_nodes[set.nodes[first_boundary(group) + b]].row;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const uint32_t i = 3 * row + axis;
      const uint32_t panel = i / pack::kPanelRows;
      field[3 * b + axis] = is_own
                                ? entry_of_site(pack, state.rings, set.sites[contact], place, i)
                                : pack.max_displacement / pack::kPairUnit *
                                      panel_of_pair(pack, set.sites[contact], set.sites[other],
                                                    panel)[place * pack::kPanelRows + i % pack::kPanelRows];
    }
  }
  if (!is_nothing) state.kernel.add_symmetric_product(group.whole, group.boundary_stride, field, pull);
  float* to_field = group.exterior_fields + column * stride;
  float* to_pull = group.exterior_pulls + column * stride;
  bool fits = true;
  for (uint32_t i = 0; i < stride; ++i) {
    fits = fits && fabs(field[i]) <= kLargest && fabs(pull[i]) <= kLargest;
    to_field[i] = fits ? static_cast<float>(field[i]) : 0;
    to_pull[i] = fits ? static_cast<float>(pull[i]) : 0;
  }
  return fits;
}

void fill_exterior_state(const pal_pack& pack, const ZoneState& state, FieldState& field) {
  const ZoneSet& set = state.active;
  field.num_exterior = set.num_groups > 0 ? set.num_contacts : 0;
  field.exterior_rings = state.rings;
  if (field.num_exterior == 0) return;
  for (uint32_t c = 0; c < set.num_contacts; ++c) field.exterior_sites[c] = set.sites[c];
  const uint32_t of_contacts = set.num_contacts * pack.zone_columns;
  const double of_pairs = pack.metres * pack.max_displacement / pack::kPairUnit;
  for (uint32_t j = 0; j < num_exterior_columns(pack, set.num_contacts); ++j) {
    const double unit =
        j < of_contacts ? pack.metres * unit_of_column(pack, state.rings, set.sites[j / pack.zone_columns],
                                                       j % pack.zone_columns)
                        : of_pairs;
    field.exterior_weights[j] = static_cast<pal_real>(unit * set.weights[j]);
  }
}

void add_exterior_field(const pal_pack& pack, const FieldState& field, uint32_t first, uint32_t count,
                        const FieldKernel& kernel, pal_real* sum) {
  for (uint32_t c = 0; c < field.num_exterior; ++c) {
    const uint32_t site = field.exterior_sites[c];
    BasisCombination columns;
    static_assert(pack::num_monomials(2, pack::kMostZoneDegree) <= sizeof columns.weights / sizeof(pal_real));
    columns.field = panel_of_site(pack, field.exterior_rings, site, 0);
    columns.is_rounded = pack.zone_rounded;
    columns.num_columns = columns.num_weighted = pack.zone_columns;
    memcpy(columns.weights, field.exterior_weights + size_t{c} * pack.zone_columns,
           pack.zone_columns * sizeof *columns.weights);
    // Of near contacts the higher degrees weigh nothing.
    while (columns.num_weighted > 3 && columns.weights[columns.num_weighted - 1] == 0) --columns.num_weighted;
    if (columns.is_rounded) round_weights(columns);
    fill_columns(columns, first, count, kernel, true, sum);
    for (uint32_t other = 0; other < c && pack.num_pair_fields > 0; ++other) {
      const pal_real* weights =
          field.exterior_weights + first_column_of_pair(pack, field.num_exterior, c, other);
      if (site == field.exterior_sites[other]) continue;
      for (uint32_t panel = 0; panel < count; ++panel)
        kernel.add_bytes(panel_of_pair(pack, site, field.exterior_sites[other], first + panel), weights,
                         pack.num_pair_fields, sum + size_t{panel} * pack::kPanelRows);
    }
  }
}

}  // namespace palpate
