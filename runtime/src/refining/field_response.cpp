#include "runtime/src/refining/field_response.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_mailbox.hpp"
#include "runtime/src/zone/zone_tangent.hpp"

namespace palpate {
namespace {

size_t column_size(const pal_pack& pack) {
  return size_t{3} * pack.organ.num_nodes;
}

// Replaces a response that no tissue has, as from a damaged pack, by zero.
pal_real bounded(double response) {
  constexpr double kLargest = 1e4;  // m/m, m/rad
  return static_cast<pal_real>(fabs(response) <= kLargest ? response : 0.0);
}

void write_packed(const pal_pack& pack, FieldResponse& response) {
  std::fill_n(response.of_packed, response.num_axes * field_size(pack), pal_real{0});
  for (uint32_t a = 0; a < response.num_axes; ++a) {
    const double* from = response.columns + a * column_size(pack);
    pal_real* to = response.of_packed + a * field_size(pack);
    for (uint32_t node = 0; node < pack.organ.num_nodes; ++node) {
      const size_t packed = pack.organ.nodes[node].packed_node;
      if (packed == pack::kNoNode) continue;
      for (size_t axis = 0; axis < 3; ++axis) to[3 * packed + axis] = bounded(from[3 * size_t{node} + axis]);
    }
  }
}

// Returns the part of Condensation::kept that lists the group's boundary nodes.
const uint32_t* boundary_nodes(const ZoneSet& set, const Condensation& condensation, const ZoneGroup& group) {
  const uint32_t* nodes = condensation.kept;
  for (const ZoneGroup* before = set.groups; before != &group; ++before) nodes += before->num_boundary;
  return nodes;
}

// Computes the force on the boundary of group g: the sum of S_gh x_h over the other groups h. x_h: `column`
// on the boundary of group h. Returns the force's place in ZoneWork::residual.
double* find_forces_of_others(ZoneFrame& frame, const Condensation& condensation, const ZoneGroup& group,
                              const double* column) {
  const ZoneSet& set = frame.set;
  const size_t row = 3 * static_cast<size_t>(boundary_nodes(set, condensation, group) - condensation.kept);
  const size_t top = row / 4 * 4;  // add_product() takes columns that begin on 16 bytes
  const auto rows = static_cast<uint32_t>(row - top + 3 * group.num_boundary);
  std::fill_n(frame.work.residual, rows + 4, 0.0);
  for (const ZoneGroup* other = set.groups; other < set.groups + set.num_groups; ++other) {
    if (other == &group) continue;
    const uint32_t* nodes = boundary_nodes(set, condensation, *other);
    for (uint32_t b = 0; b < other->num_boundary; ++b)
      memcpy(frame.work.vector + size_t{3} * b, column + size_t{3} * nodes[b], 3 * sizeof *column);
    const size_t first = 3 * static_cast<size_t>(nodes - condensation.kept);
    frame.kernel.add_product(condensation.schur + first * condensation.schur_stride + top,
                             condensation.schur_stride, rows, 3 * other->num_boundary, frame.work.vector,
                             frame.work.residual);
  }
  return frame.work.residual + (row - top);
}

// Recomputes du_h/dd of group h in `column` from the entries of other groups. Returns the largest change.
double update_group(ZoneFrame& frame, const Condensation& condensation, uint32_t axis, const ZoneGroup& group,
                    double* column) {
  const ZoneSet& set = frame.set;
  const double unit = axis < 3 * set.num_contacts ? 1.0 : frame.pack.metres;  // to m/rad
  const double* sensitivities = nullptr;  // -G_h; null if the axis belongs to another group
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    if (contact_axis(set, group, i) == axis)
      sensitivities = sensitivity(group, i) + size_t{3} * group.num_interior;
  }
  const double* step = nullptr;  // K_h^-1 sum of S_hk du_k/dd
  if (set.num_groups > 1) {
    const size_t rows = size_t{3} * group.num_boundary;
    memcpy(frame.work.outside, find_forces_of_others(frame, condensation, group, column),
           rows * sizeof(double));
    std::fill_n(frame.work.residual, group.unknowns, 0.0);
    memcpy(frame.work.residual + size_t{3} * group.num_interior, frame.work.outside, rows * sizeof(double));
    step = find_step(frame, group) + size_t{3} * group.num_interior;
  }
  double largest = 0;
  const uint32_t* nodes = boundary_nodes(set, condensation, group);
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i) {
    double& entry = column[size_t{3} * nodes[i / 3] + i % 3];
    const double value =
        (sensitivities != nullptr ? -unit * sensitivities[i] : 0.0) - (step != nullptr ? step[i] : 0.0);
    largest = std::max(largest, fabs(value - entry));
    entry = value;
  }
  return largest;
}

// Computes column `axis` of T, and the entries of M for this axis and lower axes (zone_balance.hpp).
void find_coupling_matrices(ZoneFrame& frame, const Condensation& condensation, uint32_t axis,
                            const FieldResponse& response) {
  ZoneSet& set = frame.set;
  const auto unit = [&](uint32_t a) { return a < 3 * set.num_contacts ? 1.0 : 1.0 / frame.pack.metres; };
  const auto column = [&](uint32_t a) { return response.columns + a * column_size(frame.pack); };
  double stiffness[kMostZoneAxes] = {};
  for (ZoneGroup* group = set.groups; group < set.groups + set.num_groups; ++group) {
    double* to = group->exterior.coupling + size_t{axis} * group->boundary_stride;
    const double* forces = find_forces_of_others(frame, condensation, *group, column(axis));
    const uint32_t* nodes = boundary_nodes(set, condensation, *group);
    std::fill_n(to, group->boundary_stride, 0.0);
    for (uint32_t i = 0; i < 3 * group->num_boundary; ++i) {
      to[i] = unit(axis) * forces[i];
      for (uint32_t other = 0; other <= axis; ++other)
        stiffness[other] += to[i] * unit(other) * column(other)[size_t{3} * nodes[i / 3] + i % 3];
    }
  }
  for (uint32_t other = 0; other <= axis; ++other)
    set.coupled_stiffness[axis][other] = set.coupled_stiffness[other][axis] = stiffness[other];
}

// Does a Gauss-Seidel sweep for `axis`. The last sweep finds T and M, and advances `axis`. Returns the work.
uint64_t sweep_groups(ZoneFrame& frame, const Condensation& condensation, FieldResponse& response) {
  constexpr uint32_t kMostSweeps = 8;
  constexpr double kConverged = 0.003;  // of the first sweep's change
  const ZoneSet& set = frame.set;
  double* column = response.columns + response.axis * column_size(frame.pack);
  uint64_t spent = 0;
  double change = 0;
  for (const ZoneGroup* group = set.groups; group < set.groups + set.num_groups; ++group) {
    if (!group->has_tangent) continue;
    change = std::max(change, update_group(frame, condensation, response.axis, *group, column));
    spent += uint64_t{group->unknowns} * group->unknowns;
  }
  if (response.sweep == 0) response.first_change = change;
  ++response.sweep;
  const bool needs_sweep =
      set.num_groups > 1 && response.sweep < kMostSweeps && change > kConverged * response.first_change;
  if (!needs_sweep) {
    if (set.num_groups > 1) find_coupling_matrices(frame, condensation, response.axis, response);
    ++response.axis;
    response.sweep = 0;
  }
  return spent;
}

}  // namespace

void carve_field_response(const pal_pack& pack, const ZoneRoom& room, Arena& arena, FieldResponse& response) {
  const size_t axes = room.axes_per_contact * room.contacts;
  response.columns = arena.take<double>(axes * column_size(pack));
  response.of_packed = arena.take<pal_real>(axes * field_size(pack));
}

void begin_field_response(const pal_pack& pack, const ZoneSet& set, bool is_placed, FieldResponse& response) {
  response.num_contacts = set.num_contacts;
  response.num_axes = set.num_axes;
  response.axis = response.sweep = 0;
  response.front = pack.organ.num_fronts;
  for (uint32_t i = 0; i < set.num_axes; ++i) response.followed[i] = is_placed ? set.followed[i] : 0;
  std::fill_n(response.columns, set.num_axes * column_size(pack), 0.0);
}

bool advance_field_response(ZoneFrame& frame, const Condensation& condensation, uint64_t operations,
                            CondensationScratch& scratch, FieldResponse& response, uint64_t& spent) {
  while (response.axis < response.num_axes) {
    if (spent >= operations) return false;
    spent += sweep_groups(frame, condensation, response);
  }
  for (; response.front > 0; --response.front) {
    if (spent >= operations) return false;
    // The front's factor stays in the cache for all columns.
    for (uint32_t a = 0; a < response.num_axes; ++a)
      spent += backward_substitute_front(condensation, frame.kernel, response.front - 1, scratch,
                                         response.columns + a * column_size(frame.pack));
  }
  write_packed(frame.pack, response);
  return true;
}

void update_field_response(const pal_pack& pack, const double* followed, const double* before,
                           const double* now, FieldResponse& response) {
  // Below the first distance the error that iterations leave outweighs Du. Above the second the field of one
  // iteration is too far from equilibrium, and the update would make the next field worse.
  constexpr double kLeastDistance = 0.01;  // mean surface edges
  constexpr double kMostDistance = 0.25;   // mean surface edges
  const uint32_t num_axes = response.num_axes;
  const double arm = std::max(pack.tip_radius, pack.mean_surface_edge) * pack.metres;
  double change[kMostZoneAxes];   // Dd: m, rad
  double weights[kMostZoneAxes];  // W, diagonal: U' = U + (Du - U Dd) (W Dd)^T / (Dd . W Dd)
  double square = 0;              // Dd . W Dd, m^2
  find_axes_change(response.num_contacts, num_axes, response.followed, followed, change);
  for (uint32_t i = 0; i < num_axes; ++i) {
    const bool is_turn = i >= 3 * response.num_contacts;
    if (!is_turn) change[i] *= pack.metres;
    weights[i] = is_turn ? arm * arm : 1;
    square += weights[i] * change[i] * change[i];
    response.followed[i] = followed[i];
  }
  const double distance = sqrt(square) / (pack.mean_surface_edge * pack.metres);
  if (!(distance > kLeastDistance && distance < kMostDistance)) return;
  const size_t size = field_size(pack);
  for (uint32_t node = 0; node < pack.organ.num_nodes; ++node) {
    const size_t packed = pack.organ.nodes[node].packed_node;
    if (packed == pack::kNoNode) continue;
    for (size_t axis = 0; axis < 3; ++axis) {
      pal_real* row = response.of_packed + 3 * packed + axis;
      const size_t at = 3 * size_t{node} + axis;
      double unexplained = (now[at] - before[at]) * pack.metres;
      for (uint32_t a = 0; a < num_axes; ++a) unexplained -= static_cast<double>(row[a * size]) * change[a];
      for (uint32_t a = 0; a < num_axes; ++a)
        row[a * size] =
            bounded(static_cast<double>(row[a * size]) + unexplained * weights[a] * change[a] / square);
    }
  }
}

}  // namespace palpate
