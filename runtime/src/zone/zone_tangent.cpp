#include "runtime/src/zone/zone_tangent.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>
#include <utility>

#include "runtime/src/numerics/product.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_exterior.hpp"
#include "runtime/src/zone/zone_motion.hpp"
#include "runtime/src/zone/zone_overlap.hpp"

namespace palpate {
namespace {

constexpr double kLargestForce =
    1e60;  // in units of the model: far from where those of the caller would overflow
constexpr double kMostBrought =
    0.3;  // of a change of loads, by q, of several contacts; more and its series says nothing
constexpr uint32_t kTurns = 8;       // which leave less than 0.3^9 of it, and mostly 0.02^9
constexpr double kMostTrace = 9;     // of 1 - H of one contact, 3 in a linear organ, 91 past Euler's load
constexpr double kMostSettled = 10;  // |N| of one contact; more and the organ outside gives way
// What is added to the diagonal, of it, one after the other until the stiffness is positive definite.
constexpr double kShifts[] = {0.0, 0.1, 1.0};
constexpr uint32_t kNumShifts = 3;
constexpr uint64_t kLeastSlice = 20000;  // multiply-adds

uint32_t num_sensitivities(const ZoneGroup& group) {
  return group.num_axes + group.num_fitted;
}

// R, of a contact that has neighbours; -G^T; and -Gamma G.
void add_load_rows(const ZoneFrame& frame, const ZoneGroup& group, uint32_t slot, double* matrix) {
  double derivatives[3][kMostExteriorColumns];
  differentiate_exterior(frame.pack, frame.state, frame.set, group.contacts[slot], derivatives);
  const size_t stride = group.boundary_stride;
  const uint32_t moving = 3 * group.num_boundary;
  const uint32_t fitted = group.unknowns + group.num_axes;
  double* columns = matrix + size_t{3} * group.num_interior * group.stride;
  double* pulls = frame.state.vector;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const uint32_t load = 3 * slot + axis;
    const uint32_t given = fitted + group.num_fitted + load;
    for (uint32_t i = 0; i < moving && group.num_fitted > 0; ++i)
      columns[size_t{i} * group.stride + fitted + load] = group.loads_of_moves[load * stride + i];
    memset(pulls, 0, stride * sizeof *pulls);
    add_exterior_columns(frame.pack, frame.state, frame.set, group, group.exterior_pulls, derivatives[axis],
                         pulls);
    for (uint32_t other = 0; other < group.num_fitted; ++other)
      matrix[size_t{fitted + other} * group.stride + given] =
          -product(group.loads_of_tractions + other * stride, pulls, moving);
    add_overlaps(frame.pack, frame.state, frame.set, group, 3 * group.contacts[slot] + axis, pulls);
    for (uint32_t i = 0; i < moving; ++i) columns[size_t{i} * group.stride + given] = -pulls[i];
  }
}

// Assembly goes part after part: the organ outside, some columns each; batches of elements, one after the other or, where
// they share volumes, all in one; the load rows of each contact; and what is done to the whole of it.
constexpr uint32_t kColumnsOfPart = 32;

uint32_t num_column_parts(const ZoneGroup& group) {
  return (round_to_columns(group.size) + kColumnsOfPart - 1) / kColumnsOfPart;
}

uint32_t num_parts(const ZoneGroup& group) {
  return num_column_parts(group) + num_parts(group.batches) + group.num_contacts + 1;
}

void begin_columns(const ZoneGroup& group, uint32_t part, double* matrix) {
  const size_t stride = group.stride;
  const uint32_t begin = part * kColumnsOfPart;
  const uint32_t end = std::min(round_to_columns(group.size), begin + kColumnsOfPart);
  const uint32_t boundary = 3 * group.num_interior;
  for (uint32_t column = begin; column < end; ++column) {
    double* to = matrix + column * stride;
    const size_t top = column / kEliminationRows * kEliminationRows;
    memset(to + top, 0, (stride - top) * sizeof *to);
    if (column < boundary || column >= boundary + 3 * group.num_boundary) continue;
    const uint32_t j = column - boundary;
    const double* from = group.exterior + size_t{j} * group.boundary_stride;
    memcpy(to + column, from + j, (3 * group.num_boundary - j) * sizeof *to);
  }
}

void finish_matrix(const ZoneFrame& frame, const ZoneGroup& group, double shift, double* matrix) {
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

uint64_t load_row_operations(const ZoneFrame& frame, const ZoneGroup& group) {
  return uint64_t{3} * num_exterior_columns(frame.pack, frame.set.num_contacts) * group.boundary_stride;
}

// Multiply-adds that take as long as clearing an entry of a column, which comes from afar.
constexpr uint64_t kOfEntry = 8;

// The next part of ZoneGroup::spare, at the displacements that the group has. Multiply-adds that take as long.
uint64_t assemble_part(ZoneFrame& frame, ZoneGroup& group) {
  double* matrix = group.spare;
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
  part -= num_parts(group.batches);
  if (part < group.num_contacts) {
    add_load_rows(frame, group, part, matrix);
    return load_row_operations(frame, group);
  }
  finish_matrix(frame, group, kShifts[group.shift], matrix);
  return size;
}

// What all of them take.
uint64_t assembly_operations(const ZoneFrame& frame, const ZoneGroup& group) {
  return num_column_parts(group) * kOfEntry * kColumnsOfPart * group.size +
         stiffness_operations(group.batches) + group.num_contacts * load_row_operations(frame, group) +
         group.size;
}

// Of sensitivities, of which there are three for each contact and kind: each time all of the matrix is read.
constexpr uint32_t kRowsAtOnce = 3;

// The next sensitivities of the eliminated ZoneGroup::spare. Multiply-adds that take as long.
uint64_t substitute_rows(const ZoneFrame& frame, ZoneGroup& group) {
  const uint32_t first = group.substituted;
  double* rows = group.spare_sensitivities + size_t{first} * group.unknowns;
  for (uint32_t column = 0; column < group.unknowns; ++column) {
    const double* from = group.spare + size_t{column} * group.stride + group.unknowns + first;
    for (uint32_t t = 0; t < kRowsAtOnce; ++t) rows[size_t{t} * group.unknowns + column] = from[t];
  }
  frame.state.kernel.back_substitute(group.spare, group.stride, group.unknowns, rows, group.unknowns,
                                     kRowsAtOnce);
  group.substituted += kRowsAtOnce;
  return uint64_t{group.unknowns} * group.unknowns;
}

// Rows that are left when it is taken.
bool has_last_rows(const ZoneGroup& group) {
  return group.substituted + kRowsAtOnce >= num_sensitivities(group);
}

// So much a frame that assembly, elimination and substitution but for the last rows end within kTangentFrames - 1 of them;
// taking it is one more.
uint64_t slice_of_tangent(const ZoneFrame& frame, const ZoneGroup& group) {
  uint64_t all = assembly_operations(frame, group) +
                 uint64_t{num_sensitivities(group) / kRowsAtOnce - 1} * group.unknowns * group.unknowns;
  for (uint32_t column = 0; column < group.size; column += kEliminationColumns)
    all += elimination_operations(group.size, group.unknowns, column);
  return std::max(kLeastSlice, all / (kTangentFrames - 2));
}

// x of a contact alone, of its force.
double load_per_force(const ZoneFrame& frame, const ZoneGroup& group) {
  return 1 / frame.pack.zone_force_scale[frame.set.sites[group.contacts[0]]];
}

// N times a change of loads: of one contact ZoneGroup::back, of several a series of that, H.
void settle(const ZoneGroup& group, const double* change, double* settled) {
  const uint32_t count = 3 * group.num_contacts;
  memcpy(settled, change, count * sizeof *settled);
  for (uint32_t turn = 0; turn < kTurns && group.num_contacts > 1; ++turn) {
    double next[3 * kMostZoneContacts];
    for (uint32_t i = 0; i < count; ++i)
      next[i] = change[i] + product(group.back + i * count, settled, count);
    memcpy(settled, next, count * sizeof *settled);
  }
  for (uint32_t i = 0; i < 3 && group.num_contacts == 1; ++i)
    settled[i] = product(group.back + 3 * i, change, 3);
}

// N = (1 - H)^-1, row-major, in the place of H. False where 1 - H is nearly singular, or beyond that: where the organ outside
// gives way, as a column at Euler's load does, an eigenvalue of it passes zero, or two, and they are of any size behind. All
// have positive real parts by Routh and Hurwitz, with its trace, its principal minors' sum and its determinant.
bool invert_feedback(double* matrix) {
  double a[9];
  for (uint32_t i = 0; i < 9; ++i) a[i] = (i % 4 == 0 ? 1 : 0) - matrix[i];
  double cofactors[9];
  for (uint32_t i = 0; i < 3; ++i) {
    const uint32_t p = (i + 1) % 3;
    const uint32_t q = (i + 2) % 3;
    for (uint32_t j = 0; j < 3; ++j) {
      const uint32_t r = (j + 1) % 3;
      const uint32_t s = (j + 2) % 3;
      cofactors[3 * j + i] = a[3 * p + r] * a[3 * q + s] - a[3 * p + s] * a[3 * q + r];
    }
  }
  const double determinant = a[0] * cofactors[0] + a[1] * cofactors[3] + a[2] * cofactors[6];
  const double trace = a[0] + a[4] + a[8];
  const double minors = cofactors[0] + cofactors[4] + cofactors[8];
  if (!(determinant > 0 && trace > 0 && trace <= kMostTrace && trace * minors > determinant)) return false;
  double square = 0;
  for (const double cofactor : cofactors) square += cofactor * cofactor;
  if (!(square <= kMostSettled * kMostSettled * determinant * determinant)) return false;
  for (uint32_t i = 0; i < 9; ++i) matrix[i] = cofactors[i] / determinant;
  return true;
}

// What an eliminated matrix says of the contacts. False, and nothing taken, where that is not finite.
bool take_contacts(ZoneFrame& frame, ZoneGroup& group, const double* matrix) {
  ZoneSet& set = frame.set;
  const uint32_t loads = 3 * group.num_contacts;
  const uint32_t count = group.num_axes;
  const uint32_t given = count + group.num_fitted;
  const uint32_t first_load = group.num_fitted > 0 ? count : 0;  // rows that loads go with
  const double per_row = group.num_fitted > 0 ? 1 : load_per_force(frame, group);
  const double* trailing = matrix + size_t{group.unknowns} * group.stride + group.unknowns;
  const auto left = [&](uint32_t row, uint32_t column) {
    return row > column ? trailing[size_t{column} * group.stride + row]
                        : trailing[size_t{row} * group.stride + column];
  };
  for (uint32_t j = 0; j < given; ++j) {
    for (uint32_t i = j; i < given + loads; ++i) {
      if (!(fabs(left(i, j)) <= kLargestForce)) return false;
    }
  }
  double largest = 0;
  for (uint32_t i = 0; i < loads; ++i) {
    double sum = 0;
    for (uint32_t j = 0; j < loads; ++j) {
      group.back[i * loads + j] = per_row * left(given + j, first_load + i);
      sum += fabs(group.back[i * loads + j]);
    }
    for (uint32_t axis = 0; axis < count; ++axis) group.brought[axis * loads + i] = left(given + i, axis);
    largest = std::max(largest, sum);
  }
  group.gives_way = group.num_contacts == 1 ? !invert_feedback(group.back) : largest > kMostBrought;
  if (group.gives_way) {  // both: they are one behind the other
    memset(group.brought, 0, size_t{count + loads} * loads * sizeof *group.brought);
    for (uint32_t i = 0; i < 3 && group.num_contacts == 1; ++i) group.back[4 * i] = 1;
  }
  for (uint32_t j = 0; j < count; ++j) {
    double change[3 * kMostZoneContacts] = {};
    double settled[3 * kMostZoneContacts];
    for (uint32_t i = 0; i < loads; ++i) change[i] = per_row * left(first_load + i, j);
    settle(group, change, settled);
    for (uint32_t i = 0; i < count; ++i)
      set.stiffness[contact_axis(set, group, i)][contact_axis(set, group, j)] =
          left(i, j) + product(group.brought + i * loads, settled, loads);
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
      is_positive = frame.state.kernel.eliminate_columns(group.spare, group.stride, group.size,
                                                         group.unknowns, group.column);
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
    if (group.moved <= kStill * frame.pack.mean_surface_edge) return;
    begin_tangent(group, 0);
    group.is_assembling = true;
  }
  uint64_t spent = 0;
  if (!continue_assembly(frame, slice_of_tangent(frame, group), group, spent)) {
    if (!group.is_assembling) group.has_tangent = false;  // as make_tangent(), where all shifts are in vain
    return;
  }
  if (spent > 0) return;  // taking it is work of another frame
  group.is_assembling = false;
  take_tangent(frame, group);
}

bool advance_first_tangent(const pal_pack& pack, uint64_t operations, ZoneState& state, ZoneGroup& group,
                           uint64_t& spent) {
  ZoneFrame frame = {pack, state, state.next, 0};
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
  memcpy(step, frame.state.residual, group.unknowns * sizeof *step);
  frame.state.kernel.forward_substitute(group.factor, group.stride, group.unknowns, step);
  frame.state.kernel.back_substitute(group.factor, group.stride, group.unknowns, step, group.unknowns, 1);
  return step;
}

const double* sensitivity(const ZoneGroup& group, uint32_t index) {
  return group.sensitivities + size_t{index} * group.unknowns;
}

void find_forces(ZoneFrame& frame, const ZoneGroup& group) {
  ZoneSet& set = frame.set;
  const double* residual = frame.state.residual;
  const double* tractions = set.traction + size_t{3} * first_boundary(group);
  const uint32_t loads = 3 * group.num_contacts;
  const auto behind = [&](uint32_t row) {
    return product(sensitivity(group, row), residual, group.unknowns);
  };
  double forces[kMostZoneAxes] = {};
  for (uint32_t i = 0; i < group.num_axes; ++i) forces[i] = residual[group.unknowns + i] - behind(i);
  double change[3 * kMostZoneContacts] = {};
  for (uint32_t i = 0; i < loads; ++i) {
    change[i] = -set.loads[contact_axis(set, group, i)];
    if (group.num_fitted == 0) {
      change[i] += load_per_force(frame, group) * forces[i];
    } else {
      const double* fit = group.loads_of_tractions + size_t{i} * group.boundary_stride;
      change[i] += product(fit, tractions, 3 * group.num_boundary) - behind(group.num_axes + i);
    }
  }
  double settled[3 * kMostZoneContacts];
  settle(group, change, settled);
  bool sound = true;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    forces[i] += product(group.brought + i * loads, settled, loads);
    sound = sound && fabs(forces[i]) <= kLargestForce && (i >= loads || fabs(settled[i]) <= kLargestForce);
  }
  if (!sound) {
    frame.flags |= PAL_FLAG_NOT_FINITE;
    return;
  }
  for (uint32_t i = 0; i < group.num_axes; ++i) set.force[contact_axis(set, group, i)] = forces[i];
  for (uint32_t i = 0; i < loads; ++i) set.loads[contact_axis(set, group, i)] += settled[i];
}

}  // namespace palpate
