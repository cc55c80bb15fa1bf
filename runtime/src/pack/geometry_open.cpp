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

// Whether a vector has unit length; `rounding` bounds the error of the squared length.
template <typename Real>
bool are_unit_vectors(const Real* vectors, size_t count, Real rounding) {
  bool are = true;
  for (const Real* v = vectors; v != vectors + 3 * count; v += 3) {
    const Real square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    are = are && square >= 1 - rounding && square <= 1 + rounding;
  }
  return are;
}

}  // namespace

bool read_geometry(const pack::Geometry& geometry, uint64_t first_offset, pal_pack& pack) {
  pack.num_nodes = geometry.num_nodes();
  pack.num_triangles = geometry.num_triangles();
  pack.mean_surface_edge = geometry.mean_surface_edge();
  pack.labels = array_of<int32_t>(pack, geometry.labels(), first_offset, pack.num_nodes);
  pack.positions = array_of<double>(pack, geometry.positions(), first_offset, uint64_t{3} * pack.num_nodes);
  pack.rest_positions = pack.positions;
  pack.triangles =
      array_of<uint32_t>(pack, geometry.triangles(), first_offset, uint64_t{3} * pack.num_triangles);
  if (pack.num_nodes == 0 || pack.num_nodes > kMostNodes || pack.labels == nullptr ||
      pack.positions == nullptr || pack.triangles == nullptr)
    return false;
  for (uint32_t i = 1; i < pack.num_nodes; ++i) {
    if (pack.labels[i] <= pack.labels[i - 1]) return false;
  }
  return is_scale(pack.mean_surface_edge) &&
         all_within(pack.positions, size_t{3} * pack.num_nodes, kLargestScale) &&
         indices_valid(pack.triangles, size_t{3} * pack.num_triangles, pack.num_nodes, false);
}

bool read_sites(const pack::ContactSites& sites, uint64_t first_offset, pal_pack& pack) {
  pack.num_contact_nodes = sites.num_contact_nodes();
  pack.num_sites = sites.num_sites();
  pack.max_contacts = sites.max_contacts();
  pack.tip_radius = sites.tip_radius();
  pack.max_displacement = sites.max_displacement();
  if (pack.num_sites == 0 || pack.num_contact_nodes == 0 || pack.max_contacts < 1 ||
      pack.max_contacts > pack::kMostContacts ||
      !(pack.tip_radius >= 0 && pack.tip_radius <= kLargestScale) || !is_scale(pack.max_displacement) ||
      !is_scale(pack.max_displacement * pack.metres)) {
    return false;
  }
  pack.contact_nodes = array_of<uint32_t>(pack, sites.contact_nodes(), first_offset, pack.num_contact_nodes);
  pack.site_nodes = array_of<uint32_t>(pack, sites.site_nodes(), first_offset, pack.num_sites);
  pack.patch_starts =
      array_of<uint32_t>(pack, sites.patch_starts(), first_offset, uint64_t{pack.num_sites} + 1);
  if (pack.contact_nodes == nullptr || pack.site_nodes == nullptr || pack.patch_starts == nullptr)
    return false;
  if (!indices_valid(pack.contact_nodes, pack.num_contact_nodes, pack.num_nodes, true)) return false;
  if (!indices_valid(pack.site_nodes, pack.num_sites, pack.num_nodes, true)) return false;
  if (pack.patch_starts[0] != 0) return false;
  pack.max_patch_nodes = 0;
  for (uint32_t site = 0; site < pack.num_sites; ++site) {
    if (pack.patch_starts[site + 1] <= pack.patch_starts[site]) return false;
    const uint32_t size = pack.patch_starts[site + 1] - pack.patch_starts[site];
    if (size > pack.num_contact_nodes) return false;
    if (size > pack.max_patch_nodes) pack.max_patch_nodes = size;
  }
  pack.patch_nodes =
      array_of<uint32_t>(pack, sites.patch_nodes(), first_offset, pack.patch_starts[pack.num_sites]);
  if (pack.patch_nodes == nullptr) return false;
  for (uint32_t site = 0; site < pack.num_sites; ++site) {
    const uint32_t start = pack.patch_starts[site];
    if (!indices_valid(pack.patch_nodes + start, pack.patch_starts[site + 1] - start, pack.num_contact_nodes,
                       true))
      return false;
  }
  if (sites.inward_normals() == nullptr) return true;
  pack.inward_normals =
      array_of<double>(pack, sites.inward_normals(), first_offset, uint64_t{3} * pack.num_sites);
  return pack.inward_normals != nullptr && are_unit_vectors(pack.inward_normals, pack.num_sites, 1e-9);
}

bool read_surface_bvh(const pack::SurfaceBvh& surface, uint64_t first_offset, pal_pack& pack) {
  pack.num_primitives = surface.num_primitives();
  pack.num_bvh_nodes = surface.num_nodes();
  const uint64_t corners = uint64_t{3} * pack.num_primitives;
  pack.primitives = array_of<uint32_t>(pack, surface.primitives(), first_offset, corners);
  pack.bvh_nodes = array_of<pack::BvhNode>(pack, surface.nodes(), first_offset, pack.num_bvh_nodes);
  pack.primitive_normals = array_of<float>(pack, surface.primitive_normals(), first_offset, 4 * corners);
  pack.site_normals =
      array_of<float>(pack, surface.site_normals(), first_offset, uint64_t{3} * pack.num_sites);
  if (pack.primitives == nullptr || pack.bvh_nodes == nullptr || pack.primitive_normals == nullptr ||
      pack.site_normals == nullptr || pack.num_bvh_nodes == 0) {
    return false;
  }
  constexpr float kNormalRounding = 1e-5f;
  // The bound of boxes, which the builder rounds outward from positions within kLargestScale.
  constexpr auto kLargestBound = static_cast<float>(1.001 * kLargestScale);
  const pack::BvhNode& root = pack.bvh_nodes[0];
  return all_within(root.min, 3, kLargestBound) && all_within(root.max, 3, kLargestBound) &&
         indices_valid(pack.primitives, corners, pack.num_sites, false) &&
         are_unit_vectors(pack.primitive_normals, size_t{4} * pack.num_primitives, kNormalRounding) &&
         are_unit_vectors(pack.site_normals, pack.num_sites, kNormalRounding) && is_surface_tree(pack);
}

}  // namespace palpate
