#include "runtime/src/refining/delivery.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

bool find_correction(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of, bool& is_finite) {
  constexpr double kMostUnbalanced = 0.1;
  constexpr double kRounding = 1e-6;  // near rest all that is stored may be unbalanced
  ZoneDelivery& delivery = of.mailbox.delivery;
  double energy = 0;  // of the boundary: w_e . (c + S w_e / 2)
  double sum = 0;
  const uint32_t* nodes = of.own.kept;
  const float* block = of.blocks;
  double* force = delivery.force;
  for (uint32_t g = 0; g < of.outline.num_groups; ++g) {
    const GroupLayout& group = of.outline.groups[g];
    const uint32_t stride = group.boundary_stride;
    memset(of.moved, 0, stride * sizeof *of.moved);
    memset(of.forces, 0, stride * sizeof *of.forces);
    const auto at = [&](uint32_t i) { return size_t{3} * nodes[i / 3] + i % 3; };
    for (uint32_t i = 0; i < 3 * group.num_boundary; ++i)
      of.moved[i] = of.exterior.displacement[at(i)] - of.rest[at(i)];  // w_e
    kernel.add_symmetric_product(block, stride, of.moved, of.forces);
    for (uint32_t i = 0; i < 3 * group.num_boundary; ++i, ++force) {
      *force = of.exterior.forces[at(i)] - of.forces[i];
      energy += of.moved[i] * (*force + 0.5 * of.forces[i]);
      sum += *force;
    }
    nodes += group.num_boundary;
    block += size_t{stride} * stride;
  }
  double unbalanced = 0;
  for (uint32_t node = 0; node < pack.organ.num_nodes; ++node) {
    if (of.own.roles[node] != NodeRole::eliminated) continue;
    const double* below = of.exterior.forces + size_t{3} * node;  // L^-1 r
    for (int axis = 0; axis < 3; ++axis) unbalanced += 0.5 * below[axis] * below[axis];
  }
  delivery.energy = of.exterior.energy - unbalanced - energy;
  const bool has_fallen = unbalanced < 0.5 * of.history.unbalanced;
  of.history.unbalanced = unbalanced;
  if (has_fallen) of.history.failures = 0;
  is_finite = isfinite(sum) && isfinite(delivery.energy);
  const double rounding = kRounding * (fabs(of.exterior.rest_energy) + of.history.largest_energy);
  return is_finite && unbalanced <= kMostUnbalanced * of.exterior.energy + rounding;
}

void copy_blocks(Refinement& of) {
  const ZoneOutline& outline = of.outline;
  float* to = of.blocks;
  memset(to, 0, outline.exterior_size * sizeof *to);
  size_t first = 0;
  for (uint32_t g = 0; g < outline.num_groups; ++g) {
    const size_t rows = size_t{3} * outline.groups[g].num_boundary;
    const size_t stride = outline.groups[g].boundary_stride;
    for (size_t column = 0; column < rows; ++column)
      memcpy(to + column * stride, of.own.schur + (first + column) * of.own.schur_stride + first,
             rows * sizeof *to);
    to += stride * stride;
    first += rows;
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
