#include "runtime/src/zone_tangent.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack_view.hpp"
#include "runtime/src/zone_exterior.hpp"

namespace palpate {
namespace {

constexpr double kLargestForce =
    1e60;  // in units of the model: far from where those of the caller would overflow
constexpr double kMostBrought = 0.3;  // of a change of force, by q; more and its series says nothing
constexpr uint32_t kTurns = 8;        // which leave less than 0.3^9 of it, and mostly 0.02^9
// What is added to the diagonal, of it, one after the other until the stiffness is positive definite.
constexpr double kShifts[] = {0.0, 0.1, 1.0};
constexpr uint32_t kNumShifts = 3;
constexpr uint64_t kLeastSlice = 40000;  // multiply-adds
constexpr double kStill = 1e-9;          // in mean edges of the surface: nothing has moved

double* row_of(const ZoneGroup& group, uint32_t index) {
  return group.sensitivities + size_t{index} * group.unknowns;
}

// -T dq/df of a contact of the group, as its three rows.
void add_exterior_rows(const ZoneFrame& frame, const ZoneGroup& group, uint32_t slot, double* matrix) {
  double derivatives[3][kMostExteriorColumns];
  differentiate_exterior(frame.pack, frame.set, frame.state.rings, group.contacts[slot], derivatives);
  const uint32_t first = group.unknowns + group.num_axes + 3 * slot;
  double* rows = matrix + first + size_t{3} * group.num_interior * group.stride;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    double* row = frame.state.vector;
    memset(row, 0, group.boundary_stride * sizeof *row);
    frame.state.kernel.add_product(group.exterior_pulls, group.boundary_stride, group.boundary_stride,
                                   num_exterior_columns(frame.pack, frame.set.num_contacts),
                                   derivatives[axis], row);
    for (uint32_t i = 0; i < 3 * group.num_boundary; ++i) rows[size_t{i} * group.stride + axis] = -row[i];
  }
}

void assemble(ZoneFrame& frame, const ZoneGroup& group, double shift, double* matrix) {
  ZoneState& state = frame.state;
  const ZoneSet& set = frame.set;
  const size_t stride = group.stride;
  for (uint32_t column = 0; column < round_to_columns(group.size); ++column) {
    const size_t from = column / kEliminationRows * kEliminationRows;
    memset(matrix + column * stride + from, 0, (stride - from) * sizeof *matrix);
  }
  const ZoneUnknowns unknowns = {set.unknown_of, set.first_master, set.masters};
  for (uint32_t i = 3 * group.first_node; i < 3 * (group.first_node + group.num_nodes); ++i)
    state.forces[i] = -set.rest_force[i];
  add_zone_stiffness(group.batches, set.displacement, unknowns, state.forces, matrix, group.stride);
  const uint32_t boundary = 3 * group.num_interior;
  for (uint32_t j = 0; j < 3 * group.num_boundary; ++j) {
    const double* from = group.exterior + size_t{j} * group.boundary_stride;
    double* to = matrix + (boundary + j) * stride + boundary;
    for (uint32_t i = j; i < 3 * group.num_boundary; ++i) to[i] += from[i];
  }
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) add_exterior_rows(frame, group, slot, matrix);
  const uint32_t free = group.num_interior + group.num_boundary;
  for (uint32_t i = 3 * free; i < group.unknowns; ++i) matrix[i * stride + i] = 1;
  for (uint32_t i = 0; i < free; ++i) {
    const uint32_t axes = moving_axes(frame.pack, set, group.first_node + i);
    for (uint32_t axis = 0; axis < 3 && axes != 7; ++axis) {
      if ((axes >> axis & 1) == 0) drop_unknown(3 * i + axis, group.size, group.stride, matrix);
    }
  }
  for (uint32_t i = 0; i < group.unknowns && shift > 0; ++i) matrix[i * stride + i] *= 1 + shift;
}

// The sums of (1 - H)^-1 where q brings H of a change of force back, as long as that is a small part of it; and of torques, what
// that brings them, H_t (1 - H)^-1.
void find_brought(const ZoneGroup& group, const double* trailing, ZoneSet& set) {
  const uint32_t count = 3 * group.num_contacts;
  const auto back = [&](uint32_t i, uint32_t j) {
    return trailing[size_t{i} * group.stride + group.num_axes + j];
  };
  double largest = 0;
  for (uint32_t i = 0; i < count; ++i) {
    double sum = 0;
    for (uint32_t j = 0; j < count; ++j) sum += fabs(back(i, j));
    largest = std::max(largest, sum);
  }
  const bool is_small = largest <= kMostBrought;
  for (uint32_t column = 0; column < count; ++column) {
    double sum[3 * kMostZoneContacts] = {};
    sum[column] = 1;
    for (uint32_t turn = 0; turn < kTurns && is_small; ++turn) {
      double next[3 * kMostZoneContacts];
      for (uint32_t i = 0; i < count; ++i) {
        next[i] = i == column ? 1 : 0;
        for (uint32_t j = 0; j < count; ++j) next[i] += back(i, j) * sum[j];
      }
      memcpy(sum, next, count * sizeof *sum);
    }
    for (uint32_t i = 0; i < group.num_axes; ++i) {
      double brought = i < count ? sum[i] : 0.0;
      for (uint32_t j = 0; j < count && i >= count && is_small; ++j) brought += back(i, j) * sum[j];
      set.brought[contact_axis(set, group, i)][contact_axis(set, group, column)] = brought;
    }
  }
}

// What an eliminated matrix says of the contacts. False, and nothing taken, where that is not finite.
bool take_contacts(ZoneFrame& frame, ZoneGroup& group, const double* matrix) {
  ZoneSet& set = frame.set;
  const double* trailing = matrix + size_t{group.unknowns} * group.stride + group.unknowns;
  const uint32_t forces = 3 * group.num_contacts;
  const uint32_t count = group.num_axes;
  for (uint32_t j = 0; j < count; ++j) {
    for (uint32_t i = j; i < count + forces; ++i) {
      if (!(fabs(trailing[size_t{j} * group.stride + i]) <= kLargestForce)) return false;
    }
  }
  find_brought(group, trailing, set);
  const auto felt = [&](uint32_t i, uint32_t j) {
    return i > j ? trailing[size_t{j} * group.stride + i] : trailing[size_t{i} * group.stride + j];
  };
  for (uint32_t i = 0; i < count; ++i) {
    for (uint32_t j = 0; j < count; ++j) {
      double sum = i < forces ? 0.0 : felt(i, j);
      for (uint32_t k = 0; k < forces; ++k)
        sum += set.brought[contact_axis(set, group, i)][contact_axis(set, group, k)] * felt(k, j);
      set.stiffness[contact_axis(set, group, i)][contact_axis(set, group, j)] = sum;
    }
  }
  for (uint32_t i = 0; i < count; ++i) {
    for (uint32_t j = 0; j < i; ++j) {
      double& lower = set.stiffness[contact_axis(set, group, i)][contact_axis(set, group, j)];
      double& upper = set.stiffness[contact_axis(set, group, j)][contact_axis(set, group, i)];
      lower = upper = 0.5 * (lower + upper);
    }
  }
  return true;
}

// Group::spare, eliminated, becomes the tangent.
bool take_tangent(ZoneFrame& frame, ZoneGroup& group) {
  if (!take_contacts(frame, group, group.spare)) return false;
  double* made = group.spare;
  group.spare = group.factor;
  group.factor = made;
  for (uint32_t column = 0; column < group.unknowns; ++column) {
    const double* from = made + size_t{column} * group.stride + group.unknowns;
    for (uint32_t t = 0; t < group.num_axes; ++t) row_of(group, t)[column] = from[t];
  }
  frame.state.kernel.back_substitute(made, group.stride, group.unknowns, group.sensitivities, group.unknowns,
                                     group.num_axes);
  group.has_tangent = true;
  group.is_shifted = group.shift > 0;
  group.moved = group.moved_since;
  group.left = 0;
  return true;
}

void begin_tangent(ZoneFrame& frame, ZoneGroup& group, uint32_t shift) {
  group.shift = shift;
  group.column = 0;
  group.moved_since = 0;
  assemble(frame, group, kShifts[shift], group.spare);
}

}  // namespace

bool make_tangent(ZoneFrame& frame, ZoneGroup& group) {
  group.has_tangent = false;
  group.is_making = false;
  for (uint32_t shift = 0; shift < kNumShifts; ++shift) {
    begin_tangent(frame, group, shift);
    if (!eliminate(frame.state.kernel, group.spare, group.stride, group.size, group.unknowns)) continue;
    if (take_tangent(frame, group)) return true;
    frame.flags |= PAL_FLAG_NOT_FINITE;
    break;
  }
  return false;
}

void advance_tangent(ZoneFrame& frame, ZoneGroup& group) {
  if (!group.has_tangent) return;
  if (!group.is_making) {
    if (group.moved <= kStill * frame.pack.mean_surface_edge) return;
    begin_tangent(frame, group, 0);
    group.is_making = true;
    return;
  }
  const uint64_t all = uint64_t{group.size} * group.size * group.size / 6;
  const uint64_t slice = all / (kTangentFrames - 1) > kLeastSlice ? all / (kTangentFrames - 1) : kLeastSlice;
  for (uint64_t spent = 0; spent < slice && group.column < group.size; group.column += kEliminationColumns) {
    const uint64_t columns = group.column < group.unknowns ? group.column : group.unknowns;
    spent += uint64_t{kEliminationColumns} * (group.size - group.column) * (columns + kEliminationColumns);
    if (frame.state.kernel.eliminate_columns(group.spare, group.stride, group.size, group.unknowns,
                                             group.column))
      continue;
    group.is_making = group.shift + 1 < kNumShifts;
    if (group.is_making) {
      begin_tangent(frame, group, group.shift + 1);
    } else {
      group.has_tangent = false;  // as make_tangent(), where all shifts are in vain
    }
    return;
  }
  if (group.column < group.size) return;
  group.is_making = false;
  take_tangent(frame, group);
}

double contraction(const ZoneFrame& frame, const ZoneGroup& group) {
  constexpr double kStiffening =
      2;  // by a move of one mean edge, of the stiffness: elements at a patch are strained by 1
  constexpr double kOfShifted = 0.5;
  const double expected = kStiffening * group.moved / frame.pack.mean_surface_edge;
  return std::min(1.0, std::max(group.is_shifted ? std::max(expected, kOfShifted) : expected, group.left));
}

const double* find_step(ZoneFrame& frame, const ZoneGroup& group) {
  double* step = row_of(group, group.num_axes);
  memcpy(step, frame.state.residual, group.unknowns * sizeof *step);
  frame.state.kernel.forward_substitute(group.factor, group.stride, group.unknowns, step);
  frame.state.kernel.back_substitute(group.factor, group.stride, group.unknowns, step, group.unknowns, 1);
  return step;
}

const double* sensitivity(const ZoneGroup& group, uint32_t index) {
  return row_of(group, index);
}

void find_forces(ZoneFrame& frame, const ZoneGroup& group) {
  ZoneSet& set = frame.set;
  const double* residual = frame.state.residual;
  const uint32_t count = 3 * group.num_contacts;
  // At the q that there was, of forces less what they were; then with what the difference brings.
  double change[kMostZoneAxes];
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const double* row = row_of(group, i);
    double sum = residual[group.unknowns + i];
    for (uint32_t k = 0; k < group.unknowns; ++k) sum -= row[k] * residual[k];
    change[i] = i < count ? sum - set.force[contact_axis(set, group, i)] : sum;
  }
  double forces[kMostZoneAxes];
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    forces[i] = i < count ? set.force[contact_axis(set, group, i)] : change[i];
    for (uint32_t j = 0; j < count; ++j)
      forces[i] += set.brought[contact_axis(set, group, i)][contact_axis(set, group, j)] * change[j];
    if (!(fabs(forces[i]) <= kLargestForce)) {
      frame.flags |= PAL_FLAG_NOT_FINITE;
      return;
    }
  }
  for (uint32_t i = 0; i < group.num_axes; ++i) set.force[contact_axis(set, group, i)] = forces[i];
}

}  // namespace palpate
