#include "runtime/src/zone/zone_tangent.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>
#include <utility>

#include "runtime/src/numerics/product.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_motion.hpp"

namespace palpate {
namespace {

constexpr double kLargestForce =
    1e60;  // in units of the model: far from where those of the caller would overflow
// What is added to the diagonal, of it, one after the other until the stiffness is positive definite.
constexpr float kShifts[] = {0.0F, 0.1F, 1.0F};
constexpr uint32_t kNumShifts = 3;
constexpr uint64_t kLeastSlice = 20000;  // multiply-adds

// Assembly has these parts:
//   - S of the exterior, some columns a part,
//   - the elements, a batch a part; elements that share volumes are one part,
//   - fixed axes, unit pivots and the shift, in one part.
constexpr uint32_t kColumnsOfPart = 32;

uint32_t num_column_parts(const ZoneGroup& group) {
  return (round_to_columns(group.size) + kColumnsOfPart - 1) / kColumnsOfPart;
}

uint32_t num_parts(const ZoneGroup& group) {
  return num_column_parts(group) + num_parts(group.batches) + 1;
}

void begin_columns(const ZoneGroup& group, uint32_t part, float* matrix) {
  const size_t stride = group.stride;
  const uint32_t begin = part * kColumnsOfPart;
  const uint32_t end = std::min(round_to_columns(group.size), begin + kColumnsOfPart);
  const uint32_t boundary = 3 * group.num_interior;
  for (uint32_t column = begin; column < end; ++column) {
    float* to = matrix + column * stride;
    const size_t top = column / kEliminationRows * kEliminationRows;
    memset(to + top, 0, (stride - top) * sizeof *to);
    if (column < boundary || column >= boundary + 3 * group.num_boundary) continue;
    const uint32_t j = column - boundary;
    const float* from = group.exterior + size_t{j} * group.boundary_stride;
    memcpy(to + column, from + j, (3 * group.num_boundary - j) * sizeof *to);
  }
}

void finish_matrix(const ZoneFrame& frame, const ZoneGroup& group, float shift, float* matrix) {
  const size_t stride = group.stride;
  const uint32_t free = group.num_interior + group.num_boundary;
  for (uint32_t i = 3 * free; i < group.unknowns; ++i) matrix[i * stride + i] = 1;
  for (uint32_t i = 0; i < free; ++i) {
    const uint32_t axes = moving_axes(frame.pack, frame.set, group.first_node + i);
    for (uint32_t axis = 0; axis < 3 && axes != 7; ++axis) {
      if ((axes >> axis & 1) == 0) drop_unknown(3 * i + axis, group.size, group.stride, matrix);
    }
  }
  for (uint32_t i = 0; i < group.unknowns && shift > 0; ++i) matrix[i * stride + i] *= 1 + shift;
}

// Multiply-adds that take as long as clearing an entry of a column, which comes from afar.
constexpr uint64_t kOfEntry = 8;

// The next part of ZoneGroup::spare, at the displacements that the group has. Multiply-adds that take as long.
uint64_t assemble_part(ZoneFrame& frame, ZoneGroup& group) {
  float* matrix = group.spare;
  uint32_t part = group.assembled++;
  const uint32_t size = group.size;
  if (part < num_column_parts(group)) {
    begin_columns(group, part, matrix);
    return kOfEntry * kColumnsOfPart * size;
  }
  part -= num_column_parts(group);
  if (part < num_parts(group.batches)) {
    const ZoneUnknowns unknowns = {frame.set.unknown_of, frame.set.first_master, frame.set.masters};
    const ZoneBatches some = part_of(group.batches, part);
    add_zone_stiffness(some, frame.set.displacement, unknowns, matrix, group.stride);
    return stiffness_operations(some);
  }
  finish_matrix(frame, group, kShifts[group.shift], matrix);
  return size;
}

// What all of them take.
uint64_t assembly_operations(const ZoneGroup& group) {
  return num_column_parts(group) * kOfEntry * kColumnsOfPart * group.size +
         stiffness_operations(group.batches) + group.size;
}

// Of sensitivities, of which there are three for each contact, or six: each time all of the matrix is read.
constexpr uint32_t kRowsAtOnce = 3;

// The next sensitivities of the eliminated ZoneGroup::spare. Multiply-adds that take as long.
uint64_t substitute_rows(const ZoneFrame& frame, ZoneGroup& group) {
  const uint32_t first = group.substituted;
  double* rows = group.spare_sensitivities + size_t{first} * group.unknowns;
  for (uint32_t column = 0; column < group.unknowns; ++column) {
    const float* from = group.spare + size_t{column} * group.stride + group.unknowns + first;
    for (uint32_t t = 0; t < kRowsAtOnce; ++t)
      rows[size_t{t} * group.unknowns + column] = static_cast<double>(from[t]);
  }
  frame.kernel.back_substitute(group.spare, group.stride, group.unknowns, rows, group.unknowns, kRowsAtOnce);
  group.substituted += kRowsAtOnce;
  return uint64_t{group.unknowns} * group.unknowns;
}

// Rows that are left when it is taken.
bool has_last_rows(const ZoneGroup& group) {
  return group.substituted + kRowsAtOnce >= group.num_axes;
}

// So much a frame that assembly, elimination and substitution but for the last rows end within kTangentFrames - 1 of them;
// taking it is one more.
uint64_t slice_of_tangent(const ZoneGroup& group) {
  uint64_t all = assembly_operations(group) +
                 uint64_t{group.num_axes / kRowsAtOnce - 1} * group.unknowns * group.unknowns;
  for (uint32_t column = 0; column < group.size; column += kEliminationColumns)
    all += elimination_operations(group.size, group.unknowns, column);
  return std::max(kLeastSlice, all / (kTangentFrames - 2));
}

// What an eliminated matrix says of the contacts. False, and nothing taken, where that is not finite.
bool take_contacts(ZoneFrame& frame, ZoneGroup& group, const float* matrix) {
  const float* trailing = matrix + size_t{group.unknowns} * group.stride + group.unknowns;
  for (uint32_t j = 0; j < group.num_axes; ++j) {
    for (uint32_t i = j; i < group.num_axes; ++i) {
      if (!isfinite(trailing[size_t{j} * group.stride + i])) return false;
    }
  }
  ZoneSet& set = frame.set;
  // A matrix that was made stiffer is not the tissue's: on nearly incompressible tissue a tool would feel 80 times as much.
  const uint32_t first = contact_axis(set, group, 0);
  if (group.shift > 0 && set.stiffness[first][first] > 0) return true;
  for (uint32_t j = 0; j < group.num_axes; ++j) {
    const uint32_t column = contact_axis(set, group, j);
    for (uint32_t i = j; i < group.num_axes; ++i) {
      const uint32_t row = contact_axis(set, group, i);
      set.stiffness[row][column] = set.stiffness[column][row] =
          static_cast<double>(trailing[size_t{j} * group.stride + i]);
    }
  }
  return true;
}

// Group::spare, eliminated, becomes the tangent.
bool take_tangent(ZoneFrame& frame, ZoneGroup& group) {
  if (!take_contacts(frame, group, group.spare)) return false;
  substitute_rows(frame, group);
  std::swap(group.factor, group.spare);
  std::swap(group.sensitivities, group.spare_sensitivities);
  group.has_tangent = true;
  group.is_shifted = group.shift > 0;
  group.moved = group.moved_since;
  group.left = 0;
  return true;
}

void begin_tangent(ZoneGroup& group, uint32_t shift) {
  group.shift = shift;
  group.assembled = 0;
  group.column = 0;
  group.substituted = 0;
  group.moved_since = 0;
  group.has_new_exterior = false;
}

// Goes on until so much is spent, and anew, made stiffer, where it is not positive definite. True once nothing is left but
// to take it; is_assembling ends where all shifts were in vain.
bool continue_assembly(ZoneFrame& frame, uint64_t operations, ZoneGroup& group, uint64_t& spent) {
  while (group.is_assembling) {
    while (spent < operations && group.assembled < num_parts(group)) spent += assemble_part(frame, group);
    bool is_positive = true;
    for (; is_positive && spent < operations && group.column < group.size;
         group.column += kEliminationColumns) {
      spent += elimination_operations(group.size, group.unknowns, group.column);
      is_positive =
          frame.kernel.eliminate_columns(group.spare, group.stride, group.size, group.unknowns, group.column);
    }
    if (is_positive) {
      if (group.assembled < num_parts(group) || group.column < group.size) return false;
      while (spent < operations && !has_last_rows(group)) spent += substitute_rows(frame, group);
      return has_last_rows(group);
    }
    group.is_assembling = group.shift + 1 < kNumShifts;
    if (group.is_assembling) begin_tangent(group, group.shift + 1);
  }
  return false;
}

}  // namespace

bool make_tangent(ZoneFrame& frame, ZoneGroup& group) {
  group.has_tangent = false;
  begin_tangent(group, 0);
  group.is_assembling = true;
  uint64_t spent = 0;
  const bool is_made = continue_assembly(frame, UINT64_MAX, group, spent);
  group.is_assembling = false;
  if (is_made && !take_tangent(frame, group)) frame.flags |= PAL_FLAG_NOT_FINITE;
  return group.has_tangent;
}

void advance_tangent(ZoneFrame& frame, ZoneGroup& group) {
  if (!group.has_tangent) return;
  if (!group.is_assembling) {
    if (group.moved <= kStill * frame.pack.mean_surface_edge && !group.has_new_exterior) return;
    begin_tangent(group, 0);
    group.is_assembling = true;
  }
  uint64_t spent = 0;
  if (!continue_assembly(frame, slice_of_tangent(group), group, spent)) {
    if (!group.is_assembling) group.has_tangent = false;  // as make_tangent(), where all shifts are in vain
    return;
  }
  if (spent > 0) return;  // taking it is work of another frame
  group.is_assembling = false;
  take_tangent(frame, group);
}

bool advance_first_tangent(ZoneFrame& frame, uint64_t operations, ZoneGroup& group, uint64_t& spent) {
  if (!group.is_assembling) {
    if (spent >= operations) return false;
    place_held(frame, group);
    if (!evaluate_group(frame, group)) return true;
    spent += force_operations(group.batches);
    begin_tangent(group, 0);
    group.is_assembling = true;
  }
  const bool is_made = continue_assembly(frame, operations, group, spent);
  if (!is_made && group.is_assembling) return false;
  group.is_assembling = false;
  if (is_made) take_tangent(frame, group);
  return true;
}

double contraction(const ZoneFrame& frame, const ZoneGroup& group) {
  constexpr double kStiffening =
      2;  // by a move of one mean edge, of the stiffness: elements at a patch are strained by 1
  constexpr double kOfShifted = 0.5;
  const double expected = kStiffening * group.moved / frame.pack.mean_surface_edge;
  return std::min(1.0, std::max(group.is_shifted ? std::max(expected, kOfShifted) : expected, group.left));
}

const double* find_step(ZoneFrame& frame, const ZoneGroup& group) {
  double* step = group.step;
  memcpy(step, frame.work.residual, group.unknowns * sizeof *step);
  frame.kernel.forward_substitute(group.factor, group.stride, group.unknowns, step);
  frame.kernel.back_substitute(group.factor, group.stride, group.unknowns, step, group.unknowns, 1);
  return step;
}

const double* sensitivity(const ZoneGroup& group, uint32_t index) {
  return group.sensitivities + size_t{index} * group.unknowns;
}

void find_forces(ZoneFrame& frame, const ZoneGroup& group) {
  ZoneSet& set = frame.set;
  const double* residual = frame.work.residual;
  double forces[kMostZoneAxes];
  bool sound = true;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    forces[i] = residual[group.unknowns + i] - product(sensitivity(group, i), residual, group.unknowns);
    sound = sound && fabs(forces[i]) <= kLargestForce;
  }
  if (!sound) {
    frame.flags |= PAL_FLAG_NOT_FINITE;
    return;
  }
  for (uint32_t i = 0; i < group.num_axes; ++i) set.force[contact_axis(set, group, i)] = forces[i];
}

}  // namespace palpate
