#include "runtime/src/zone/delivery.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

bool find_correction(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of, bool& is_finite) {
  constexpr double kMostUnbalanced = 0.1;
  constexpr double kRounding = 1e-6;  // near rest all that is stored may be unbalanced
  ZoneDelivery& delivery = of.mailbox.delivery;
  const uint32_t stride = of.own.schur_stride;
  const uint32_t count = 3 * of.own.num_kept;
  memset(of.forces, 0, stride * sizeof *of.forces);
  memset(of.moved, 0, stride * sizeof *of.moved);
  for (uint32_t i = 0; i < count; ++i) {
    const size_t at = size_t{3} * of.own.kept[i / 3] + i % 3;
    of.moved[i] = of.exterior.displacement[at] - of.rest[at];  // w_e
  }
  kernel.add_symmetric_product(of.own.schur, stride, of.moved, of.forces);
  double unbalanced = 0;
  for (uint32_t node = 0; node < pack.organ.num_nodes; ++node) {
    if (of.own.roles[node] != NodeRole::eliminated) continue;
    const double* below = of.exterior.forces + size_t{3} * node;  // L^-1 r
    for (int axis = 0; axis < 3; ++axis) unbalanced += 0.5 * below[axis] * below[axis];
  }
  delivery.energy = of.exterior.energy - unbalanced;
  const bool has_fallen = unbalanced < 0.5 * of.unbalanced;
  of.unbalanced = unbalanced;
  if (has_fallen) of.failures = 0;
  double sum = 0;
  for (uint32_t i = 0; i < count; ++i) {
    delivery.force[i] = of.exterior.forces[size_t{3} * of.own.kept[i / 3] + i % 3] - of.forces[i];
    delivery.energy -= of.moved[i] * (delivery.force[i] + 0.5 * of.forces[i]);
    sum += delivery.force[i];
  }
  is_finite = isfinite(sum) && isfinite(delivery.energy);
  const double rounding = kRounding * (fabs(of.exterior.rest_energy) + of.largest_energy);
  return is_finite && unbalanced <= kMostUnbalanced * of.exterior.energy + rounding;
}

void write_tangent(const Refinement& of, float* to) {
  const ZoneOutline& outline = of.outline;
  const auto copy_block = [&](uint32_t first_row, uint32_t rows, uint32_t first_column, uint32_t columns,
                              size_t stride) {
    for (size_t column = 0; column < size_t{3} * columns; ++column, to += stride)
      memcpy(to,
             of.own.schur + (3 * size_t{first_column} + column) * of.own.schur_stride + 3 * size_t{first_row},
             size_t{3} * rows * sizeof *to);
  };
  memset(to, 0, outline.exterior_size * sizeof *to);
  for (uint32_t g = 0, row = 0; g < outline.num_groups; row += outline.groups[g++].num_boundary) {
    const ZoneOutline::Group& group = outline.groups[g];
    const size_t stride = group.boundary_stride;
    copy_block(row, group.num_boundary, row, group.num_boundary, stride);
    to += stride * (stride - size_t{3} * group.num_boundary);
    for (uint32_t h = 0, column = 0; h < outline.num_groups; column += outline.groups[h++].num_boundary) {
      if (h != g) copy_block(row, group.num_boundary, column, outline.groups[h].num_boundary, stride);
    }
  }
}

void write_field(const pal_pack& pack, const Refinement& of) {
  pal_real* field = of.mailbox.request.field;
  for (uint32_t node = 0; node < pack.organ.num_nodes; ++node) {
    const size_t packed = pack.organ.nodes[node].packed_node;
    if (packed == pack::kNoNode) continue;
    for (size_t axis = 0; axis < 3; ++axis)
      field[3 * packed + axis] =
          static_cast<pal_real>(of.exterior.displacement[3 * size_t{node} + axis] * pack.metres);
  }
  const size_t size = field_size(pack);
  memcpy(field + size, of.response.of_packed, of.response.num_axes * size * sizeof *field);
}

double find_change(const pal_pack& pack, const Refinement& of) {
  double largest = 0;
  for (size_t i = 0; i < size_t{3} * pack.organ.num_nodes; ++i)
    largest = std::max(largest, fabs(of.exterior.displacement[i] - of.exterior.next[i]));
  return largest;
}

}  // namespace palpate
