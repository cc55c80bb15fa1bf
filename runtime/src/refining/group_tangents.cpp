#include "runtime/src/refining/group_tangents.hpp"

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

// TangentSource::elements of a group; a part is the group's elements of a front.
struct FrontElements {
  const GroupTangentSource& source;
  uint32_t group;
};

uint64_t add_front(const void* elements, uint32_t front, float* matrix) {
  const auto& [source, group] = *static_cast<const FrontElements*>(elements);
  const ZoneLayout& layout = source.layout;
  const auto zone = static_cast<uint8_t>(group + 1);
  const ZoneBatches batches = batches_of_front(source.elements, layout.zone_of_simd_lane, zone, front);
  const uint64_t operations = stiffness_operations(batches);
  if (operations == 0) return 0;
  const ZoneUnknowns unknowns = {layout.members.unknown_of, layout.members.first_master, source.masters,
                                 layout.place_of_node};
  settle_pressures(batches, source.displacement);
  add_zone_stiffness(batches, source.displacement, unknowns, matrix, layout.groups[group].stride);
  return operations;
}

}  // namespace

bool advance_group_tangents(const GroupTangentSource& source, uint64_t operations,
                            const TangentBuffers& buffers, Tangent* made, GroupTangents& tangents,
                            uint64_t& spent) {
  const ZoneLayout& layout = source.layout;
  const float* block = source.blocks;
  for (uint32_t g = 0; g < tangents.group; ++g)
    block += size_t{layout.groups[g].boundary_stride} * layout.groups[g].boundary_stride;
  for (; tangents.group < layout.num_groups; ++tangents.group, tangents.maker = {}) {
    const GroupLayout& group = layout.groups[tangents.group];
    const FrontElements elements = {source, tangents.group};
    const TangentSource group_source = {source.pack, source.kernel, layout.members,
                                        group,       block,         source.pack.organ.num_fronts,
                                        &elements,   add_front};
    Progress progress = Progress::goes_on;
    while (progress == Progress::goes_on && spent < operations)
      progress = advance_tangent(group_source, operations, buffers.matrices + group.matrix_place,
                                 buffers.rows + group.rows_place, tangents.maker, spent);
    if (progress == Progress::goes_on) return false;
    made[tangents.group] = progress == Progress::failed ? Tangent::none
                           : tangents.maker.shift > 0   ? Tangent::shifted
                                                        : Tangent::sound;
    block += size_t{group.boundary_stride} * group.boundary_stride;
  }
  return true;
}

}  // namespace palpate
