#include "runtime/src/zone/zone_tangent.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/numerics/product.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/tangent_maker.hpp"

namespace palpate {
namespace {

constexpr double kLargestForce = 1e60;  // model units; leaves room for a conversion to the caller's units

// Is TangentSource::elements of a group. add_elements() adds all elements of the group as one part.
struct GroupElements {
  const ZoneFrame& frame;
  const ZoneGroup& group;
};

uint64_t add_elements(const void* elements, uint32_t, float* matrix) {
  const auto& [frame, group] = *static_cast<const GroupElements*>(elements);
  const ZoneUnknowns unknowns = {frame.set.unknown_of, frame.set.first_master, frame.set.masters};
  add_zone_stiffness(group.batches, frame.set.displacement, unknowns, matrix, group.stride);
  return 0;  // make_tangent() has no budget
}

// Records the kind of the group's new tangent, and copies the stiffness of the contacts to the set.
void take_tangent(Tangent made, ZoneSet& set, ZoneGroup& group) {
  group.has_tangent = made != Tangent::none;
  group.tangent.is_shifted = made == Tangent::shifted;
  group.tangent.residual_ratio = 0;
  // A raised diagonal makes nearly incompressible tissue much too stiff, so an earlier stiffness stays.
  const uint32_t first = contact_axis(set, group, 0);
  if (!group.has_tangent || (group.tangent.is_shifted && set.stiffness[first][first] > 0)) return;
  const float* trailing = group.tangent.factor + size_t{group.unknowns} * group.stride + group.unknowns;
  for (uint32_t j = 0; j < group.num_axes; ++j) {
    const uint32_t column = contact_axis(set, group, j);
    for (uint32_t i = j; i < group.num_axes; ++i) {
      const uint32_t row = contact_axis(set, group, i);
      set.stiffness[row][column] = set.stiffness[column][row] =
          static_cast<double>(trailing[size_t{j} * group.stride + i]);
    }
  }
}

}  // namespace

bool make_tangent(ZoneFrame& frame, ZoneGroup& group) {
  const GroupElements elements = {frame, group};
  const TangentSource source = {frame.pack, frame.kernel, frame.set,   group, group.exterior.stiffness,
                                1,          &elements,    add_elements};
  TangentMaker maker = {};
  uint64_t spent = 0;
  Progress progress = Progress::goes_on;
  while (progress == Progress::goes_on)
    progress =
        advance_tangent(source, UINT64_MAX, group.tangent.factor, group.tangent.sensitivities, maker, spent);
  Tangent made = maker.shift > 0 ? Tangent::shifted : Tangent::sound;
  if (progress == Progress::failed) {
    made = Tangent::none;
    // With all sensitivities computed, only a number that is not finite is left as the cause.
    if (maker.substituted == group.num_axes) frame.flags |= PAL_FLAG_NOT_FINITE;
  }
  take_tangent(made, frame.set, group);
  group.tangent.moved = 0;
  group.tangent.age = 0;
  return group.has_tangent;
}

void use_tangents(const TangentBuffers& buffers, const Tangent* made, ZoneSet& set) {
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    group.tangent.factor = buffers.matrices + group.matrix_place;
    group.tangent.sensitivities = buffers.rows + group.rows_place;
    take_tangent(made[g], set, group);
    group.tangent.moved = group.tangent.moved_since;
    group.tangent.age = group.tangent.age_since;
  }
}

void count_solve(const ZoneFrame& frame, ZoneGroup& group) {
  const bool is_there = group.tangent.moved <= kSamePlace * frame.pack.max_displacement;
  group.tangent.age = is_there ? 0 : group.tangent.age + 1;
  ++group.tangent.age_since;
}

bool is_outdated(const ZoneFrame& frame, const ZoneGroup& group) {
  constexpr double kFar = 0.5;  // mean surface edges
  return group.tangent.moved > kFar * frame.pack.mean_surface_edge ||
         group.tangent.age + 1 >= PAL_ZONE_STIFFNESS_FRAMES;
}

double contraction(const ZoneFrame& frame, const ZoneGroup& group) {
  constexpr double kShiftedContraction = 0.5;  // least estimate for a tangent with a raised diagonal
  const double expected = kStiffening * group.tangent.moved / frame.pack.mean_surface_edge;
  return std::min(1.0, std::max(group.tangent.is_shifted ? std::max(expected, kShiftedContraction) : expected,
                                group.tangent.residual_ratio));
}

const double* find_step(ZoneFrame& frame, const ZoneGroup& group) {
  double* step = group.tangent.step;
  memcpy(step, frame.work.residual, group.unknowns * sizeof *step);
  frame.kernel.forward_substitute(group.tangent.factor, group.stride, group.unknowns, step);
  frame.kernel.back_substitute(group.tangent.factor, group.stride, group.unknowns, step, group.unknowns, 1);
  return step;
}

const double* sensitivity(const ZoneGroup& group, uint32_t index) {
  return group.tangent.sensitivities + size_t{index} * group.unknowns;
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
