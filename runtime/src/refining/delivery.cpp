#include "runtime/src/refining/delivery.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

bool find_correction(const pal_pack& pack, const EliminationKernel& kernel, Refinement& lane,
                     bool& is_finite) {
  constexpr double kMostUnbalanced = 0.1;
  constexpr double kRounding = 1e-6;  // of the largest energies; near rest E itself may be rounding
  ZoneDelivery& delivery = lane.mailbox.delivery;
  double boundary_energy = 0;  // w_e . (c + S w_e / 2)
  double sum = 0;              // of c: finite only if each entry is finite
  const uint32_t* nodes = lane.condensation.kept;
  const float* block = lane.blocks;
  double* force = delivery.force;
  for (uint32_t g = 0; g < lane.layout.num_groups; ++g) {
    const GroupLayout& group = lane.layout.groups[g];
    const uint32_t stride = group.boundary_stride;
    memset(lane.moved, 0, stride * sizeof *lane.moved);
    memset(lane.linear_forces, 0, stride * sizeof *lane.linear_forces);
    const auto at = [&](uint32_t i) { return size_t{3} * nodes[i / 3] + i % 3; };
    for (uint32_t i = 0; i < 3 * group.num_boundary; ++i)
      lane.moved[i] = lane.exterior.displacement[at(i)] - lane.rest[at(i)];  // w_e
    kernel.add_symmetric_product(block, stride, lane.moved, lane.linear_forces);
    for (uint32_t i = 0; i < 3 * group.num_boundary; ++i, ++force) {
      *force = lane.exterior.forces[at(i)] - lane.linear_forces[i];
      boundary_energy += lane.moved[i] * (*force + 0.5 * lane.linear_forces[i]);
      sum += *force;
    }
    nodes += group.num_boundary;
    block += size_t{stride} * stride;
  }
  double unbalanced = 0;
  for (uint32_t node = 0; node < pack.organ.num_nodes; ++node) {
    if (lane.condensation.roles[node] != NodeRole::eliminated) continue;
    const double* reduced_force = lane.exterior.forces + size_t{3} * node;  // L^-1 r
    for (int axis = 0; axis < 3; ++axis) unbalanced += 0.5 * reduced_force[axis] * reduced_force[axis];
  }
  delivery.energy = lane.exterior.energy - unbalanced - boundary_energy;
  const bool has_halved = unbalanced < 0.5 * lane.history.unbalanced;
  lane.history.unbalanced = unbalanced;
  if (has_halved) lane.history.failures = 0;
  is_finite = isfinite(sum) && isfinite(delivery.energy);
  const double rounding = kRounding * (fabs(lane.exterior.rest_energy) + lane.history.largest_energy);
  return is_finite && unbalanced <= kMostUnbalanced * lane.exterior.energy + rounding;
}

void copy_blocks(Refinement& lane) {
  const ZoneLayout& layout = lane.layout;
  float* to = lane.blocks;
  memset(to, 0, layout.stiffness_size * sizeof *to);
  size_t first = 0;
  for (uint32_t g = 0; g < layout.num_groups; ++g) {
    const size_t rows = size_t{3} * layout.groups[g].num_boundary;
    const size_t stride = layout.groups[g].boundary_stride;
    for (size_t column = 0; column < rows; ++column)
      memcpy(to + column * stride,
             lane.condensation.schur + (first + column) * lane.condensation.schur_stride + first,
             rows * sizeof *to);
    to += stride * stride;
    first += rows;
  }
}

void write_field(const pal_pack& pack, const Refinement& lane) {
  pal_real* field = lane.mailbox.request.field;
  for (uint32_t node = 0; node < pack.organ.num_nodes; ++node) {
    const size_t packed = pack.organ.nodes[node].packed_node;
    if (packed == pack::kNoNode) continue;
    for (size_t axis = 0; axis < 3; ++axis)
      field[3 * packed + axis] =
          static_cast<pal_real>(lane.exterior.displacement[3 * size_t{node} + axis] * pack.metres);
  }
  const size_t size = field_size(pack);
  memcpy(field + size, lane.response.of_packed, lane.response.num_axes * size * sizeof *field);
}

double find_largest_change(const pal_pack& pack, const Refinement& lane) {
  double largest = 0;
  for (size_t i = 0; i < size_t{3} * pack.organ.num_nodes; ++i)
    largest = std::max(largest, fabs(lane.exterior.displacement[i] - lane.exterior.next[i]));
  return largest;
}

}  // namespace palpate
