#include "runtime/src/nonlinear_zone.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/pack_view.hpp"
#include "runtime/src/zone_exterior.hpp"

namespace palpate {
namespace {

// Of what the contacts are moved by at most: a Newton step below it ends the iterations, and the next would be its square.
constexpr double kConverged = 2e-3;
constexpr uint32_t kMostCuts = 6;
constexpr double kLargestForce =
    1e60;  // in units of the model: far from where those of the caller would overflow
constexpr uint32_t kMostFailures = 8;
constexpr double kFarthest = 1e4;     // displacement of any node, in units of the scene's largest
constexpr double kMostBrought = 0.3;  // of a change of force, by q; more and its series says nothing
constexpr uint32_t kTurns = 8;        // which leave less than 0.3^9 of it, and mostly 0.02^9
// Of a contact in one frame, in mean edges of the surface: no tool moves as fast, but some take hold under strain.
constexpr double kLongestStep = 0.5;

struct Frame {
  const pal_pack& pack;
  ZoneState& state;
  ZoneSet& set;
  uint32_t flags;
};

uint32_t boundary_place(const ZoneGroup& group, uint32_t index) {
  return group.first_node + group.num_interior + index;
}

// w of the boundary, [boundary_stride].
void gather_boundary(const Frame& frame, const ZoneGroup& group, double* out) {
  memset(out, 0, group.boundary_stride * sizeof *out);
  for (uint32_t b = 0; b < group.num_boundary; ++b) {
    const uint32_t place = boundary_place(group, b);
    const double* rest = frame.pack.zone_nodes[frame.set.nodes[place]].displacement;
    for (uint32_t axis = 0; axis < 3; ++axis)
      out[3 * b + axis] = frame.set.displacement[3 * place + axis] - rest[axis];
  }
}

// Adds T q of what the organ outside adds to its linear answer.
void add_exterior_pull(const Frame& frame, const ZoneGroup& group) {
  const size_t stride = group.boundary_stride;
  double weights[kMostExteriorColumns];
  weigh_exterior(frame.pack, frame.set, frame.state.rings, weights);
  for (uint32_t j = 0; j < num_exterior_columns(frame.pack, frame.set.num_contacts); ++j) {
    const double* pull = group.exterior_pulls + j * stride;
    for (size_t i = 0; i < stride; ++i) frame.state.pull[i] += weights[j] * pull[i];
  }
}

// T b into state.pull: how far the other groups' tractions and the organ's nonlinear part move the boundary, and the
// forces that this takes.
void find_pull(Frame& frame, const ZoneGroup& group) {
  ZoneState& state = frame.state;
  const ZoneSet& set = frame.set;
  memset(state.pull, 0, group.boundary_stride * sizeof *state.pull);
  add_exterior_pull(frame, group);
  if (set.num_groups == 1) return;
  double* moved = state.boundary;
  memset(moved, 0, group.boundary_stride * sizeof *moved);
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& other = set.groups[g];
    for (uint32_t j = 0; j < other.num_boundary && &other != &group; ++j) {
      const double* t = set.traction + size_t{3} * boundary_place(other, j);
      for (uint32_t i = 0; i < group.num_boundary; ++i) {
        double block[9];
        zone_compliance(frame.pack, set.nodes[boundary_place(group, i)], set.nodes[boundary_place(other, j)],
                        block);
        for (uint32_t axis = 0; axis < 3; ++axis)
          moved[3 * i + axis] +=
              block[3 * axis] * t[0] + block[3 * axis + 1] * t[1] + block[3 * axis + 2] * t[2];
      }
    }
  }
  state.kernel.add_product(group.whole, group.boundary_stride, group.boundary_stride, moved, state.pull);
}

// S w_B - T b, [3 boundary nodes]; leaves w_B in state.boundary.
const double* find_outside_force(Frame& frame, const ZoneGroup& group) {
  ZoneState& state = frame.state;
  gather_boundary(frame, group, state.boundary);
  for (uint32_t i = 0; i < group.boundary_stride; ++i) state.vector[i] = -state.pull[i];
  state.kernel.add_product(group.exterior, group.boundary_stride, group.boundary_stride, state.boundary,
                           state.vector);
  return state.vector;
}

// Forces that no tissue takes, as of a compliance that is positive definite in each group and not as a whole, are none.
void find_traction(Frame& frame, const ZoneGroup& group) {
  constexpr double kMostMoved =
      1e4;  // in units of what moves this node alone by the scene's largest displacement
  ZoneState& state = frame.state;
  double* t = state.vector;
  gather_boundary(frame, group, state.boundary);
  for (uint32_t i = 0; i < group.boundary_stride; ++i) t[i] = -state.pull[i];
  state.kernel.add_product(group.whole, group.boundary_stride, group.boundary_stride, state.boundary, t);
  bool sound = true;
  for (size_t i = 0; i < size_t{3} * group.num_boundary; ++i) {
    const double own = group.whole[i * group.boundary_stride + i];
    sound = sound && fabs(t[i]) <= kMostMoved * frame.pack.max_displacement * own;
  }
  double* to = frame.set.traction + size_t{3} * boundary_place(group, 0);
  const size_t bytes = size_t{3} * group.num_boundary * sizeof *t;
  if (sound) {
    memcpy(to, t, bytes);
  } else {
    memset(to, 0, bytes);
    frame.flags |= PAL_FLAG_NOT_FINITE;
  }
}

// The patches of the group's contacts as they are to be.
void place_held(Frame& frame, const ZoneGroup& group) {
  ZoneSet& set = frame.set;
  const uint32_t first = group.first_node + group.num_interior + group.num_boundary;
  for (uint32_t i = first; i < first + group.num_held; ++i) {
    double* to = set.displacement + size_t{3} * i;
    memcpy(to, frame.pack.zone_nodes[set.nodes[i]].displacement, 3 * sizeof *to);
    for (uint32_t m = set.first_master[i]; m < set.first_master[i + 1]; ++m) {
      const ZoneMaster& master = set.masters[m];
      const double* d = set.followed + 3 * group.contacts[(master.unknown - group.unknowns) / 3];
      for (int axis = 0; axis < 3; ++axis) to[axis] += master.share * d[axis];
    }
  }
}

// No element is inverted or nearly so, and no node so far away that numbers lose their meaning.
bool is_upright(const Frame& frame, const ZoneGroup& group) {
  const double* u = frame.set.displacement + size_t{3} * group.first_node;
  const double limit = kFarthest * frame.pack.max_displacement;
  for (uint32_t i = 0; i < group.num_nodes; ++i) {
    const double* rest = frame.pack.zone_nodes[frame.set.nodes[group.first_node + i]].displacement;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      if (!(fabs(u[3 * i + axis] - rest[axis]) <= limit)) return false;
    }
  }
  return smallest_jacobian(group.batches, frame.set.displacement) > kLeastJacobian;
}

double* row_of(const ZoneGroup& group, uint32_t index) {
  return group.sensitivities + size_t{index} * group.unknowns;
}

// Adds factor times a row to the displacements of the unknowns.
void add_row(const Frame& frame, const ZoneGroup& group, uint32_t index, double factor) {
  const double* row = row_of(group, index);
  double* u = frame.set.displacement + size_t{3} * group.first_node;
  for (uint32_t i = 0; i < 3 * (group.num_interior + group.num_boundary); ++i) u[i] += factor * row[i];
}

void save(const Frame& frame, const ZoneGroup& group) {
  const size_t first = size_t{3} * group.first_node;
  memcpy(frame.state.saved + first, frame.set.displacement + first,
         size_t{3} * group.num_nodes * sizeof(double));
}

void restore(Frame& frame, const ZoneGroup& group) {
  const size_t first = size_t{3} * group.first_node;
  memcpy(frame.set.displacement + first, frame.state.saved + first,
         size_t{3} * group.num_nodes * sizeof(double));
}

// Takes the contacts towards where they are to be, the rest along as it followed last. As far as all elements stay upright.
void move_contacts(Frame& frame, const ZoneGroup& group, const double* wanted) {
  ZoneSet& set = frame.set;
  save(frame, group);
  double before[3 * kMostZoneContacts];
  memcpy(before, set.followed, size_t{3} * set.num_contacts * sizeof *before);
  double longest = 0;
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const uint32_t at = 3 * group.contacts[slot] + axis;
      longest = fmax(longest, fabs(wanted[at] - before[at]));
    }
  }
  const double limit = kLongestStep * frame.pack.mean_surface_edge;
  double part = longest > limit ? limit / longest : 1.0;
  for (uint32_t cut = 0; cut <= kMostCuts; ++cut, part *= 0.5) {
    for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
      for (uint32_t axis = 0; axis < 3; ++axis) {
        const uint32_t at = 3 * group.contacts[slot] + axis;
        const double step = part * (wanted[at] - before[at]);
        set.followed[at] = before[at] + step;
        if (group.has_sensitivities) add_row(frame, group, 3 * slot + axis, -step);
      }
    }
    place_held(frame, group);
    if (is_upright(frame, group)) {
      if (part < 1) frame.flags |= PAL_FLAG_UNCONVERGED;
      return;
    }
    restore(frame, group);
    memcpy(set.followed, before, size_t{3} * set.num_contacts * sizeof *before);
  }
  frame.flags |= PAL_FLAG_UNCONVERGED;
}

// Behind the contacts, whose displacements are unknowns.
uint32_t load_row(const ZoneGroup& group) {
  return group.unknowns + 3 * group.num_contacts;
}

// -T dq/df of a contact of the group, as its three rows.
void add_exterior_rows(const Frame& frame, const ZoneGroup& group, uint32_t slot, double* matrix) {
  double derivatives[3][kMostExteriorColumns];
  differentiate_exterior(frame.pack, frame.set, frame.state.rings, group.contacts[slot], derivatives);
  double* rows = matrix + load_row(group) + 1 + 3 * slot + size_t{3} * group.num_interior * group.stride;
  for (uint32_t j = 0; j < num_exterior_columns(frame.pack, frame.set.num_contacts); ++j) {
    const double* pull = group.exterior_pulls + size_t{j} * group.boundary_stride;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const double derivative = derivatives[axis][j];
      if (derivative == 0) continue;
      for (uint32_t i = 0; i < 3 * group.num_boundary; ++i)
        rows[size_t{i} * group.stride + axis] -= derivative * pull[i];
    }
  }
}

// The matrix of an iteration; `shift` of its diagonal is added to it.
void assemble(Frame& frame, const ZoneGroup& group, double shift) {
  const pal_pack& pack = frame.pack;
  ZoneState& state = frame.state;
  const ZoneSet& set = frame.set;
  double* matrix = state.frame;
  const size_t stride = group.stride;
  for (uint32_t column = 0; column < round_to_columns(group.size); ++column) {
    const size_t from = column / kEliminationRows * kEliminationRows;
    memset(matrix + column * stride + from, 0, (stride - from) * sizeof *matrix);
  }
  const size_t first = size_t{3} * group.first_node;
  for (size_t i = first; i < first + size_t{3} * group.num_nodes; ++i) state.forces[i] = -set.rest_force[i];
  const ZoneUnknowns unknowns = {set.unknown_of, set.first_master, set.masters};
  add_zone_stiffness(group.batches, set.displacement, unknowns, state.forces, matrix, group.stride);

  const uint32_t boundary = 3 * group.num_interior;
  for (uint32_t j = 0; j < 3 * group.num_boundary; ++j) {
    const double* from = group.exterior + size_t{j} * group.boundary_stride;
    double* to = matrix + (boundary + j) * stride + boundary;
    for (uint32_t i = j; i < 3 * group.num_boundary; ++i) to[i] += from[i];
  }
  const double* outside = find_outside_force(frame, group);
  double* at_boundary = state.forces + size_t{3} * boundary_place(group, 0);
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i) at_boundary[i] += outside[i];

  // The residual as a row, and -G^T.
  const size_t load = load_row(group);
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) add_exterior_rows(frame, group, slot, matrix);
  const uint32_t free = group.num_interior + group.num_boundary;
  for (uint32_t i = 0; i < 3 * free; ++i) matrix[i * stride + load] = state.forces[first + i];
  for (uint32_t i = group.first_node + free; i < group.first_node + free + group.num_held; ++i) {
    for (uint32_t m = set.first_master[i]; m < set.first_master[i + 1]; ++m) {
      const ZoneMaster& master = set.masters[m];
      for (uint32_t axis = 0; axis < 3; ++axis)
        matrix[(master.unknown + axis) * stride + load] += master.share * state.forces[3 * i + axis];
    }
  }
  for (uint32_t i = 3 * free; i < group.unknowns; ++i) matrix[i * stride + i] = 1;
  for (uint32_t i = 0; i < free; ++i) {
    const uint32_t axes = pack.zone_nodes[set.nodes[group.first_node + i]].free_axes;
    for (uint32_t axis = 0; axis < 3 && axes != 7; ++axis) {
      if ((axes >> axis & 1) != 0) continue;
      drop_unknown(3 * i + axis, group.size, group.stride, matrix);
    }
  }
  for (uint32_t i = 0; i < group.unknowns && shift > 0; ++i) matrix[i * stride + i] *= 1 + shift;
}

// One linearisation: the matrix eliminated, and the rows of the contacts and of the load solved for. False where it is not
// positive definite even when it is made stiffer.
bool linearise(Frame& frame, const ZoneGroup& group) {
  ZoneState& state = frame.state;
  bool sound = false;
  for (const double shift : {0.0, 0.1, 1.0}) {
    assemble(frame, group, shift);
    sound = eliminate(state.kernel, state.frame, group.stride, group.size, group.unknowns);
    if (sound) break;
    frame.flags |= PAL_FLAG_UNCONVERGED;
  }
  if (!sound) return false;
  const uint32_t count = load_row(group) + 1 - group.unknowns;
  for (uint32_t column = 0; column < group.unknowns; ++column) {
    const double* from = state.frame + size_t{column} * group.stride + group.unknowns;
    for (uint32_t t = 0; t < count; ++t) row_of(group, t)[column] = from[t];
  }
  state.kernel.back_substitute(state.frame, group.stride, group.unknowns, group.sensitivities, group.unknowns,
                               count);
  return true;
}

// What a linearisation says of the contacts.
void read_contacts(Frame& frame, const ZoneGroup& group) {
  ZoneSet& set = frame.set;
  const auto entry = [&](uint32_t row, uint32_t column) {
    const uint32_t high = row > column ? row : column;
    const uint32_t low = row > column ? column : row;
    return frame.state.frame[size_t{group.unknowns + low} * group.stride + group.unknowns + high];
  };
  const auto place = [&](uint32_t i) { return 3 * group.contacts[i / 3] + i % 3; };
  for (uint32_t i = 0; i < 3 * group.num_contacts; ++i) {
    for (uint32_t j = 0; j <= 3 * group.num_contacts; ++j) {
      if (fabs(entry(i, j)) <= kLargestForce) continue;
      frame.flags |= PAL_FLAG_NOT_FINITE;  // and what was before stays
      return;
    }
  }
  // What q brings back of a change of force, as long as that is a small part of it.
  const uint32_t count = 3 * group.num_contacts;
  double back[3 * kMostZoneContacts][3 * kMostZoneContacts];
  double largest = 0;
  for (uint32_t i = 0; i < count; ++i) {
    double sum = 0;
    for (uint32_t j = 0; j < count; ++j) {
      back[i][j] = entry(count + 1 + j, i);
      sum += fabs(back[i][j]);
    }
    largest = fmax(largest, sum);
  }
  if (!(largest <= kMostBrought)) memset(back, 0, sizeof back);
  // (1 - H)^-1 of a column, by its series.
  const auto with_exterior = [&](const double* column, double* sum) {
    memcpy(sum, column, count * sizeof *sum);
    for (uint32_t turn = 0; turn < kTurns; ++turn) {
      double next[3 * kMostZoneContacts];
      for (uint32_t i = 0; i < count; ++i) {
        next[i] = column[i];
        for (uint32_t j = 0; j < count; ++j) next[i] += back[i][j] * sum[j];
      }
      memcpy(sum, next, count * sizeof *sum);
    }
  };
  double column[3 * kMostZoneContacts] = {};
  double sum[3 * kMostZoneContacts] = {};
  for (uint32_t j = 0; j < count; ++j) {
    for (uint32_t i = 0; i < count; ++i) column[i] = entry(i, j);
    with_exterior(column, sum);
    for (uint32_t i = 0; i < count; ++i) set.stiffness[place(i)][place(j)] = sum[i];
  }
  for (uint32_t i = 0; i < count; ++i) {
    for (uint32_t j = 0; j < i; ++j) {
      double& lower = set.stiffness[place(i)][place(j)];
      double& upper = set.stiffness[place(j)][place(i)];
      lower = upper = 0.5 * (lower + upper);
    }
  }
  for (uint32_t i = 0; i < count; ++i) column[i] = entry(i, count) - set.force[place(i)];
  with_exterior(column, sum);
  for (uint32_t i = 0; i < count; ++i) set.force[place(i)] += sum[i];
}

// One Newton iteration. Its largest step, or a negative number where there was none: nothing has moved then.
double iterate(Frame& frame, ZoneGroup& group) {
  group.has_sensitivities = false;
  if (!linearise(frame, group)) return -1;
  const uint32_t load = load_row(group) - group.unknowns;
  double largest = 0;
  for (uint32_t row = 0; row <= load; ++row) {
    for (uint32_t i = 0; i < group.unknowns; ++i) {
      const double size = fabs(row_of(group, row)[i]);
      if (!(size <= kLargestForce)) return -1;
      if (row == load && size > largest) largest = size;
    }
  }
  save(frame, group);
  double part = 1;
  for (uint32_t cut = 0; cut <= kMostCuts; ++cut, part *= 0.5) {
    add_row(frame, group, load, -part);
    if (is_upright(frame, group)) {
      if (cut > 0) frame.flags |= PAL_FLAG_UNCONVERGED;
      group.has_sensitivities = true;
      read_contacts(frame, group);
      return largest;
    }
    restore(frame, group);
  }
  return -1;
}

// Where there was no way on for some frames it begins anew at rest, and comes back.
void count_failure(const Frame& frame, ZoneGroup& group) {
  if (++group.failures > kMostFailures) rest_group(frame.pack, frame.set, group);
}

// What the organ outside stores beyond t . w / 2, w = C t + b + q: of a part of q that goes with the n-th power of the
// forces, n / (n + 1) of t . q in all, as Legendre's transform of the energy in t has it.
double exterior_energy(const Frame& frame, const ZoneGroup& group) {
  const double* t = frame.set.traction + size_t{3} * boundary_place(group, 0);
  double weights[kMostExteriorColumns];
  weigh_exterior(frame.pack, frame.set, frame.state.rings, weights);
  double energy = 0;
  for (uint32_t j = 0; j < num_exterior_columns(frame.pack, frame.set.num_contacts); ++j) {
    const double* field = group.exterior_fields + size_t{j} * group.boundary_stride;
    double work = 0;
    for (uint32_t i = 0; i < 3 * group.num_boundary; ++i) work += t[i] * field[i];
    const double degree = exterior_degree(frame.set, j);
    energy += (degree / (degree + 1) - 0.5) * weights[j] * work;
  }
  return energy;
}

double energy_of(Frame& frame, const ZoneGroup& group) {
  ZoneState& state = frame.state;
  const ZoneSet& set = frame.set;
  const size_t first = size_t{3} * group.first_node;
  memset(state.forces + first, 0, size_t{3} * group.num_nodes * sizeof(double));
  double energy = add_zone_forces(group.batches, set.displacement, state.forces);
  for (uint32_t i = 0; i < group.num_nodes; ++i) {
    const double* rest = frame.pack.zone_nodes[set.nodes[group.first_node + i]].displacement;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const size_t at = first + 3 * i + axis;
      energy -= set.rest_force[at] * (set.displacement[at] - rest[axis]);
    }
  }
  const double* outside = find_outside_force(frame, group);
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i) energy += 0.5 * state.boundary[i] * outside[i];
  return energy + exterior_energy(frame, group);
}

}  // namespace

ZoneAnswer solve_zone(const pal_pack& pack, const double* displacements, uint32_t iterations,
                      ZoneState& state) {
  ZoneSet& set = state.answering;
  Frame frame = {pack, state, set, set.flags};
  state.strained = true;
  double size = 1e-6 * pack.max_displacement;
  for (uint32_t i = 0; i < 3 * set.num_contacts; ++i) {
    if (fabs(displacements[i]) > size) size = fabs(displacements[i]);
  }
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    if (!group.has_sensitivities) {
      find_pull(frame, group);
      place_held(frame, group);
      iterate(frame, group);
    }
    move_contacts(frame, group, displacements);
  }
  bool converged = false;
  bool failed[kMostZoneContacts] = {};
  for (uint32_t i = 0; i < iterations && !converged; ++i) {
    converged = set.num_groups > 0;
    for (uint32_t g = 0; g < set.num_groups; ++g) {
      ZoneGroup& group = set.groups[g];
      if (failed[g]) continue;
      find_pull(frame, group);
      const double step = iterate(frame, group);
      failed[g] = step < 0;
      converged = converged && step >= 0 && step <= kConverged * size;
      find_traction(frame, group);
    }
  }
  if (!converged) frame.flags |= PAL_FLAG_UNCONVERGED;
  ZoneAnswer answer = {0, 0};
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    if (failed[g]) {
      count_failure(frame, group);
    } else {
      group.failures = 0;
    }
    find_pull(frame, group);
    answer.energy += energy_of(frame, group);
  }
  if (!(fabs(answer.energy) <= kLargestForce)) answer.energy = 0;
  answer.flags = frame.flags;
  return answer;
}

void rest_zone(const pal_pack& pack, ZoneState& state) {
  if (!state.strained) return;
  state.strained = false;
  ZoneSet& set = state.answering;
  for (uint32_t g = 0; g < set.num_groups; ++g) rest_group(pack, set, set.groups[g]);
}

void fill_zone_field(const pal_pack& pack, const ZoneState& state, FieldState& field) {
  const ZoneSet& set = state.answering;
  field.num_held = 0;
  field.num_own = 0;
  fill_exterior_state(pack, state, field);
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    for (uint32_t b = 0; b < group.num_boundary; ++b) {
      const uint32_t place = boundary_place(group, b);
      for (uint32_t axis = 0; axis < 3; ++axis)
        field.weights[3 * field.num_held + axis] =
            static_cast<pal_real>(set.traction[3 * place + axis] * pack.metres);
      field.held[field.num_held++] = set.nodes[place];
    }
    for (uint32_t i = group.first_node; i < group.first_node + group.num_nodes; ++i) {
      const uint32_t packed = pack.zone_nodes[set.nodes[i]].packed_node;
      if (packed == pack::kNoNode) continue;
      for (uint32_t axis = 0; axis < 3; ++axis)
        field.own[3 * field.num_own + axis] =
            static_cast<pal_real>(set.displacement[3 * i + axis] * pack.metres);
      field.own_nodes[field.num_own++] = packed;
    }
  }
}

}  // namespace palpate
