#include "runtime/src/refining/group_tangents.hpp"

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

// The elements of a group, front by front.
struct FrontElements {
  const GroupTangentSource& source;
  uint32_t group;
};

uint64_t add_front(const void* elements, uint32_t front, float* matrix) {
  const auto& [source, group] = *static_cast<const FrontElements*>(elements);
  const ZoneOutline& outline = source.outline;
  const auto zone = static_cast<uint8_t>(group + 1);
  const ZoneBatches batches = batches_of_front(source.elements, outline.zone_of_lane, zone, front);
  const uint64_t operations = stiffness_operations(batches);
  if (operations == 0) return 0;
  const ZoneUnknowns unknowns = {outline.members.unknown_of, outline.members.first_master, source.masters,
                                 outline.place_of};
  settle_pressures(batches, source.displacement);
  add_zone_stiffness(batches, source.displacement, unknowns, matrix, outline.groups[group].stride);
  return operations;
}

uint32_t moving_axes_of(const void* elements, uint32_t node) {
  const auto& [source, group] = *static_cast<const FrontElements*>(elements);
  const ZoneOutline& outline = source.outline;
  return moving_axes(source.pack, outline.members, outline.groups[group].first_node + node);
}

}  // namespace

bool advance_group_tangents(const GroupTangentSource& source, uint64_t operations,
                            const TangentBuffers& buffers, Tangent* made, GroupTangents& tangents,
                            uint64_t& spent) {
  const ZoneOutline& outline = source.outline;
  const float* block = source.blocks;
  for (uint32_t g = 0; g < tangents.group; ++g)
    block += size_t{outline.groups[g].boundary_stride} * outline.groups[g].boundary_stride;
  for (; tangents.group < outline.num_groups; ++tangents.group, tangents.maker = {}) {
    const GroupLayout& layout = outline.groups[tangents.group];
    const FrontElements elements = {source, tangents.group};
    const TangentSource of_group = {source.kernel, layout,    block,         source.pack.organ.num_fronts,
                                    &elements,     add_front, moving_axes_of};
    Progress progress = Progress::goes_on;
    while (progress == Progress::goes_on && spent < operations)
      progress = advance_tangent(of_group, operations, buffers.matrices + layout.matrix_place,
                                 buffers.rows + layout.rows_place, tangents.maker, spent);
    if (progress == Progress::goes_on) return false;
    made[tangents.group] = progress == Progress::failed ? Tangent::none
                           : tangents.maker.shift > 0   ? Tangent::shifted
                                                        : Tangent::sound;
    block += size_t{layout.boundary_stride} * layout.boundary_stride;
  }
  return true;
}

}  // namespace palpate
