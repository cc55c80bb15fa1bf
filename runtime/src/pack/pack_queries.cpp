#include <palpate/palpate.h>

#include <math.h>
#include <string.h>

#include "runtime/src/base/floating_point_mode.hpp"
#include "runtime/src/base/sized_struct.hpp"
#include "runtime/src/numerics/binary_search.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/pack/surface_bvh.hpp"

namespace {

constexpr uint32_t kFirstInfoBytes = 120;
constexpr uint32_t kFirstGeometryBytes = 48;

}  // namespace

extern "C" pal_status pal_pack_get_info(const pal_pack* pack, pal_pack_info* info) noexcept {
  if (pack == nullptr || info == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  pal_pack_info all = {};
  all.num_nodes = pack->num_nodes;
  all.num_triangles = pack->num_triangles;
  all.num_sites = pack->num_sites;
  all.num_contact_nodes = pack->num_contact_nodes;
  all.max_patch_nodes = pack->max_patch_nodes;
  all.max_contacts = pack->max_contacts;
  all.has_linear = pack->field_compliance != nullptr;
  all.has_polynomial = pack->polynomial_sites != nullptr;
  all.polynomial_degree = pack->degree;
  all.has_units = pack->has_units;
  all.metres_per_length_unit = pack->metres;
  all.newtons_per_force_unit = pack->newtons;
  all.max_displacement = pack->max_displacement * pack->metres;
  all.tip_radius = pack->tip_radius * pack->metres;
  all.mean_surface_edge = pack->mean_surface_edge * pack->metres;
  all.has_gravity = pack->has_gravity;
  all.gravity_may_turn = pack->contact_per_gravity != nullptr;
  all.zone_rings = pack->zone_rings;
  for (int i = 0; i < 3; ++i) all.gravity[i] = pack->acceleration[i] * pack->metres;
  return palpate::write_sized(all, kFirstInfoBytes, *info);
}

extern "C" pal_status pal_pack_get_geometry(const pal_pack* pack, pal_geometry* geometry) noexcept {
  if (pack == nullptr || geometry == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  pal_geometry all = {};
  all.num_nodes = pack->num_nodes;
  all.num_triangles = pack->num_triangles;
  all.labels = pack->labels;
  all.positions = pack->positions;
  all.triangles = pack->triangles;
  all.rest_positions = pack->rest_positions;
  return palpate::write_sized(all, kFirstGeometryBytes, *geometry);
}

extern "C" pal_status pal_pack_find_site(const pal_pack* pack, int32_t node_label, uint32_t* site) noexcept {
  if (pack == nullptr || site == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  const uint32_t found = palpate::find_sorted(pack->num_sites, node_label,
                                              [&](uint32_t i) { return pack->labels[pack->site_nodes[i]]; });
  if (found == pack->num_sites) return PAL_STATUS_NO_SUCH_SITE;
  *site = found;
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_pack_find_contact_node(const pal_pack* pack, int32_t node_label,
                                                 uint32_t* contact_node) noexcept {
  if (pack == nullptr || contact_node == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  const uint32_t found = palpate::find_sorted(
      pack->num_contact_nodes, node_label, [&](uint32_t i) { return pack->labels[pack->contact_nodes[i]]; });
  if (found == pack->num_contact_nodes) return PAL_STATUS_NO_SUCH_NODE;
  *contact_node = found;
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_pack_get_site_node(const pal_pack* pack, uint32_t site, uint32_t* node) noexcept {
  if (pack == nullptr || node == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (site >= pack->num_sites) return PAL_STATUS_NO_SUCH_SITE;
  *node = pack->site_nodes[site];
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_pack_find_surface_point(const pal_pack* pack, const double position[3],
                                                  pal_surface_point* point) noexcept {
  if (pack == nullptr || position == nullptr || point == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  const palpate::FloatingPointMode mode;
  double place[3];
  for (int i = 0; i < 3; ++i) {
    if (!(fabs(position[i]) <= 1e100)) return PAL_STATUS_NOT_FINITE;
    place[i] = position[i] / pack->metres;
  }
  if (pack->bvh_nodes == nullptr) return PAL_STATUS_NO_SUCH_MODEL;
  palpate::SurfaceHit hit;
  if (!palpate::find_nearest_surface_point(*pack, place, 0, hit)) return PAL_STATUS_BAD_ARGUMENT;
  pal_surface_point found = {};
  for (int i = 0; i < 3; ++i) {
    found.sites[i] = hit.sites[i];
    found.weights[i] = hit.weights[i];
    found.position[i] = hit.point[i] * pack->metres;
    found.normal[i] = hit.normal[i];
  }
  found.distance = hit.distance * pack->metres;
  memcpy(point, &found, sizeof found);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_pack_get_bytes(const pal_pack* pack, const void** bytes,
                                         size_t* num_bytes) noexcept {
  if (pack == nullptr || bytes == nullptr || num_bytes == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  *bytes = pack->bytes;
  *num_bytes = pack->num_bytes;
  return PAL_STATUS_OK;
}
