#include "runtime/src/zone_exterior.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/pack_view.hpp"

namespace palpate {
namespace {

constexpr size_t kPanelNumbers = size_t{pack::kZoneColumns} * pack::kPanelRows;

// The panels of a site outside of so many rings.
const pal_real* panels_of(const pal_pack& pack, uint32_t rings, uint32_t site) {
  return pack.zone_exterior +
         (uint64_t{rings - 1} * pack.num_sites + site) * pack.num_row_panels * kPanelNumbers;
}

constexpr uint32_t kFirst = pack::monomial_start(2);

// Monomials of degrees 0 to 3 at a contact's force. Whether it has been shortened.
bool monomials_at(const pal_pack& pack, const ZoneSet& set, uint32_t contact,
                  double monomials[kFirst + pack::kZoneColumns]) {
  constexpr double kFarthest = 2;  // in x; within the scene's largest displacement it stays about 1
  const double* force = set.force + size_t{3} * contact;
  const double per_force = 1 / pack.zone_force_scale[set.sites[contact]];
  double x[3] = {force[0] * per_force, force[1] * per_force, force[2] * per_force};
  const double length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  for (double& component : x) component *= length > kFarthest ? kFarthest / length : 1.0;
  pack::evaluate_monomials(x, pack::kZoneDegree, monomials);
  return length > kFarthest;
}

}  // namespace

void weigh_exterior(const pal_pack& pack, const ZoneSet& set, uint32_t contact,
                    double weights[pack::kZoneColumns]) {
  double monomials[kFirst + pack::kZoneColumns];
  monomials_at(pack, set, contact, monomials);
  memcpy(weights, monomials + kFirst, pack::kZoneColumns * sizeof *weights);
}

void differentiate_exterior(const pal_pack& pack, const ZoneSet& set, uint32_t contact,
                            double derivatives[3][pack::kZoneColumns]) {
  double monomials[kFirst + pack::kZoneColumns];
  const double per_force =
      monomials_at(pack, set, contact, monomials) ? 0.0 : 1 / pack.zone_force_scale[set.sites[contact]];
  pack::for_each_monomial(pack::kZoneDegree, [&](uint32_t index, uint32_t a, uint32_t b, uint32_t c) {
    if (index < kFirst) return;
    const uint32_t j = index - kFirst;
    derivatives[0][j] = a == 0 ? 0.0 : per_force * a * monomials[pack::monomial_index(a - 1, b, c)];
    derivatives[1][j] = b == 0 ? 0.0 : per_force * b * monomials[pack::monomial_index(a, b - 1, c)];
    derivatives[2][j] = c == 0 ? 0.0 : per_force * c * monomials[pack::monomial_index(a, b, c - 1)];
  });
}

void gather_exterior(const pal_pack& pack, const ZoneState& state, const ZoneSet& set, ZoneGroup& group) {
  const size_t stride = group.boundary_stride;
  const uint32_t columns = set.num_contacts * pack::kZoneColumns;
  double* pulls = group.exterior_pulls;
  memset(group.exterior_fields, 0, columns * stride * sizeof(double));
  memset(pulls, 0, columns * stride * sizeof(double));
  for (uint32_t c = 0; c < set.num_contacts; ++c) {
    const pal_real* panels = panels_of(pack, state.rings, set.sites[c]);
    for (uint32_t b = 0; b < group.num_boundary; ++b) {
      const uint32_t row = pack.zone_nodes[set.nodes[group.first_node + group.num_interior + b]].row;
      const pal_real* from =
          panels + row / pack::kPanelNodes * kPanelNumbers + size_t{3} * (row % pack::kPanelNodes);
      for (uint32_t j = 0; j < pack::kZoneColumns; ++j) {
        double* to = group.exterior_fields + (c * pack::kZoneColumns + j) * stride + size_t{3} * b;
        for (uint32_t axis = 0; axis < 3; ++axis)
          to[axis] = static_cast<double>(from[j * pack::kPanelRows + axis]);
      }
    }
  }
  for (uint32_t j = 0; j < columns; ++j)
    state.kernel.add_product(group.whole, group.boundary_stride, group.boundary_stride,
                             group.exterior_fields + j * stride, pulls + j * stride);
}

void add_exterior_field(const pal_pack& pack, const FieldState& field, uint32_t first, uint32_t count,
                        AddColumns add_columns, pal_real* sum) {
  for (uint32_t c = 0; c < field.num_exterior; ++c) {
    const pal_real* panels =
        panels_of(pack, field.exterior_rings, field.exterior_sites[c]) + first * kPanelNumbers;
    for (uint32_t panel = 0; panel < count; ++panel) {
      add_columns(panels + panel * kPanelNumbers, pack::kPanelRows,
                  field.exterior_weights + size_t{pack::kZoneColumns} * c, pack::kZoneColumns, true,
                  sum + size_t{panel} * pack::kPanelRows);
    }
  }
}

}  // namespace palpate
