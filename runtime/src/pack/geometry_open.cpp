#include "runtime/src/pack/geometry_open.hpp"

#include "runtime/src/pack/number_checks.hpp"
#include "runtime/src/pack/surface_bvh.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

// Whether all indices are below `limit`, and strictly ascending if `rising`.
bool indices_valid(const uint32_t* indices, size_t count, uint32_t limit, bool rising) {
  for (size_t i = 0; i < count; ++i) {
    if (indices[i] >= limit) return false;
    if (rising && i > 0 && indices[i] <= indices[i - 1]) return false;
  }
  return true;
}

// Whether all vectors [count][3] have unit length. `rounding` bounds the error of the squared length.
template <typename Real>
bool are_unit_vectors(const Real* vectors, size_t count, Real rounding) {
  bool are_unit = true;
  for (const Real* v = vectors; v != vectors + 3 * count; v += 3) {
    const Real square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    are_unit = are_unit && square >= 1 - rounding && square <= 1 + rounding;
  }
  return are_unit;
}

}  // namespace

bool read_geometry(const pack::Geometry& geometry, uint64_t first_offset, pal_pack& view) {
  view.num_nodes = geometry.num_nodes();
  view.num_triangles = geometry.num_triangles();
  view.mean_surface_edge = geometry.mean_surface_edge();
  view.labels = array_of<int32_t>(view, geometry.labels(), first_offset, view.num_nodes);
  view.positions = array_of<double>(view, geometry.positions(), first_offset, uint64_t{3} * view.num_nodes);
  view.rest_positions = view.positions;
  view.triangles =
      array_of<uint32_t>(view, geometry.triangles(), first_offset, uint64_t{3} * view.num_triangles);
  if (view.num_nodes == 0 || view.num_nodes > kMostNodes || view.labels == nullptr ||
      view.positions == nullptr || view.triangles == nullptr)
    return false;
  for (uint32_t i = 1; i < view.num_nodes; ++i) {
    if (view.labels[i] <= view.labels[i - 1]) return false;
  }
  return is_scale(view.mean_surface_edge) &&
         all_within(view.positions, size_t{3} * view.num_nodes, kLargestScale) &&
         indices_valid(view.triangles, size_t{3} * view.num_triangles, view.num_nodes, false);
}

bool read_sites(const pack::ContactSites& sites, uint64_t first_offset, pal_pack& view) {
  view.num_contact_nodes = sites.num_contact_nodes();
  view.num_sites = sites.num_sites();
  view.max_contacts = sites.max_contacts();
  view.tip_radius = sites.tip_radius();
  view.max_displacement = sites.max_displacement();
  if (view.num_sites == 0 || view.num_contact_nodes == 0 || view.max_contacts < 1 ||
      view.max_contacts > pack::kMostContacts ||
      !(view.tip_radius >= 0 && view.tip_radius <= kLargestScale) || !is_scale(view.max_displacement) ||
      !is_scale(view.max_displacement * view.metres)) {
    return false;
  }
  view.contact_nodes = array_of<uint32_t>(view, sites.contact_nodes(), first_offset, view.num_contact_nodes);
  view.site_nodes = array_of<uint32_t>(view, sites.site_nodes(), first_offset, view.num_sites);
  view.patch_starts =
      array_of<uint32_t>(view, sites.patch_starts(), first_offset, uint64_t{view.num_sites} + 1);
  if (view.contact_nodes == nullptr || view.site_nodes == nullptr || view.patch_starts == nullptr)
    return false;
  if (!indices_valid(view.contact_nodes, view.num_contact_nodes, view.num_nodes, true)) return false;
  if (!indices_valid(view.site_nodes, view.num_sites, view.num_nodes, true)) return false;
  if (view.patch_starts[0] != 0) return false;
  view.max_patch_nodes = 0;
  for (uint32_t site = 0; site < view.num_sites; ++site) {
    if (view.patch_starts[site + 1] <= view.patch_starts[site]) return false;
    const uint32_t size = view.patch_starts[site + 1] - view.patch_starts[site];
    if (size > view.num_contact_nodes) return false;
    if (size > view.max_patch_nodes) view.max_patch_nodes = size;
  }
  view.patch_nodes =
      array_of<uint32_t>(view, sites.patch_nodes(), first_offset, view.patch_starts[view.num_sites]);
  if (view.patch_nodes == nullptr) return false;
  for (uint32_t site = 0; site < view.num_sites; ++site) {
    const uint32_t start = view.patch_starts[site];
    if (!indices_valid(view.patch_nodes + start, view.patch_starts[site + 1] - start, view.num_contact_nodes,
                       true))
      return false;
  }
  if (sites.inward_normals() == nullptr) return true;
  view.inward_normals =
      array_of<double>(view, sites.inward_normals(), first_offset, uint64_t{3} * view.num_sites);
  return view.inward_normals != nullptr && are_unit_vectors(view.inward_normals, view.num_sites, 1e-9);
}

bool read_surface_bvh(const pack::SurfaceBvh& surface, uint64_t first_offset, pal_pack& view) {
  view.num_primitives = surface.num_primitives();
  view.num_bvh_nodes = surface.num_nodes();
  const uint64_t corners = uint64_t{3} * view.num_primitives;
  view.primitives = array_of<uint32_t>(view, surface.primitives(), first_offset, corners);
  view.bvh_nodes = array_of<pack::BvhNode>(view, surface.nodes(), first_offset, view.num_bvh_nodes);
  view.primitive_normals = array_of<float>(view, surface.primitive_normals(), first_offset, 4 * corners);
  view.site_normals =
      array_of<float>(view, surface.site_normals(), first_offset, uint64_t{3} * view.num_sites);
  if (view.primitives == nullptr || view.bvh_nodes == nullptr || view.primitive_normals == nullptr ||
      view.site_normals == nullptr || view.num_bvh_nodes == 0) {
    return false;
  }
  constexpr float kNormalRounding = 1e-5f;
  // The builder rounds boxes outward from positions within kLargestScale.
  constexpr auto kLargestBound = static_cast<float>(1.001 * kLargestScale);
  const pack::BvhNode& root = view.bvh_nodes[0];
  return all_within(root.min, 3, kLargestBound) && all_within(root.max, 3, kLargestBound) &&
         indices_valid(view.primitives, corners, view.num_sites, false) &&
         are_unit_vectors(view.primitive_normals, size_t{4} * view.num_primitives, kNormalRounding) &&
         are_unit_vectors(view.site_normals, view.num_sites, kNormalRounding) && is_surface_tree(view);
}

}  // namespace palpate
