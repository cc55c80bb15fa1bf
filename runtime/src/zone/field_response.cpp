#include "runtime/src/zone/field_response.hpp"

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

// A response beyond all measure, as in a damaged pack, is none.
void write_packed(const pal_pack& pack, FieldResponse& response) {
  constexpr double kLargest = 1e4;
  std::fill_n(response.of_packed, response.num_axes * field_size(pack), pal_real{0});
  for (uint32_t a = 0; a < response.num_axes; ++a) {
    const double* from = response.columns + a * column_size(pack);
    pal_real* to = response.of_packed + a * field_size(pack);
    for (uint32_t node = 0; node < pack.organ.num_nodes; ++node) {
      const size_t packed = pack.organ.nodes[node].packed_node;
      if (packed == pack::kNoNode) continue;
      for (size_t axis = 0; axis < 3; ++axis) {
        const double value = from[3 * size_t{node} + axis];
        to[3 * packed + axis] = static_cast<pal_real>(fabs(value) <= kLargest ? value : 0.0);
      }
    }
  }
}

}  // namespace

void carve_field_response(const pal_pack& pack, const ZoneRoom& room, Arena& arena, FieldResponse& response) {
  const size_t axes = room.axes_per_contact * room.contacts;
  response.columns = arena.take<double>(axes * column_size(pack));
  response.of_packed = arena.take<pal_real>(axes * field_size(pack));
}

void begin_field_response(const pal_pack& pack, const ZoneSet& set, const Condensation& own,
                          FieldResponse& response) {
  response.num_axes = set.num_axes;
  response.front = pack.organ.num_fronts;
  std::fill_n(response.columns, set.num_axes * column_size(pack), 0.0);
  const uint32_t* kept = own.kept;
  for (const ZoneGroup* group = set.groups; group < set.groups + set.num_groups; ++group) {
    for (uint32_t i = 0; i < group->num_axes && group->has_tangent; ++i) {
      const double* negative = sensitivity(*group, i) + size_t{3} * group->num_interior;
      const double unit = i < 3 * group->num_contacts ? 1.0 : pack.metres;
      double* column = response.columns + contact_axis(set, *group, i) * column_size(pack);
      for (uint32_t k = 0; k < 3 * group->num_boundary; ++k)
        column[size_t{3} * kept[k / 3] + k % 3] = -unit * negative[k];
    }
    kept += group->num_boundary;
  }
}

bool advance_field_response(const pal_pack& pack, const EliminationKernel& kernel, const Condensation& own,
                            uint64_t operations, CondensationScratch& scratch, FieldResponse& response,
                            uint64_t& spent) {
  for (; response.front > 0; --response.front) {
    if (spent >= operations) return false;
    // All columns of a front together, while its factor is in the cache.
    for (uint32_t a = 0; a < response.num_axes; ++a)
      spent += backward_substitute_front(own, kernel, response.front - 1, scratch,
                                         response.columns + a * column_size(pack));
  }
  write_packed(pack, response);
  return true;
}

}  // namespace palpate
