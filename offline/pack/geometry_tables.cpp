#include "offline/mesh/surface.hpp"
#include "offline/pack/pack_tables.hpp"
#include "offline/precompute/surface_bvh.hpp"

namespace palpate {
namespace {

std::vector<uint32_t> as_unsigned(const std::vector<int>& values) {
  return {values.begin(), values.end()};
}

// Returns the model with its nodes at rest, where tools find the surface.
Model at_rest(const PackContent& content) {
  Model model = content.model;
  if (content.rest != nullptr && !content.rest->is_mesh()) {
    for (int node = 0; node < model.num_nodes(); ++node)
      model.positions[static_cast<size_t>(node)] += content.rest->displacement.segment<3>(3 * node);
  }
  return model;
}

}  // namespace

GeometrySegments add_geometry(const Model& model, const ContactSites& sites, SegmentStore& store) {
  std::vector<int32_t> labels;
  std::vector<double> positions;
  for (const int node : sites.packed_nodes) {
    labels.push_back(model.labels[static_cast<size_t>(node)]);
    const Eigen::Vector3d& x = model.positions[static_cast<size_t>(node)];
    positions.insert(positions.end(), {x[0], x[1], x[2]});
  }
  std::vector<uint32_t> triangles;
  for (const std::array<int, 3>& triangle : sites.triangles) {
    for (const int corner : triangle) triangles.push_back(static_cast<uint32_t>(corner));
  }
  return {store.add(labels), store.add(positions), store.add(triangles)};
}

SiteSegments add_sites(const ContactSites& sites, Directions directions, SegmentStore& store) {
  std::vector<uint32_t> site_nodes;
  std::vector<uint32_t> starts = {0};
  std::vector<uint32_t> members;
  std::vector<double> normals;
  for (const ContactSite& site : sites.sites) {
    site_nodes.push_back(static_cast<uint32_t>(site.packed_node));
    for (const int member : site.patch) members.push_back(static_cast<uint32_t>(member));
    starts.push_back(static_cast<uint32_t>(members.size()));
    if (directions == Directions::inward)
      normals.insert(normals.end(), site.inward.begin(), site.inward.end());
  }
  return {store.add(as_unsigned(sites.contact_nodes)), store.add(site_nodes), store.add(starts),
          store.add(members), store.add(normals)};
}

GravitySegments add_gravity(const PackContent& content, SegmentStore& store) {
  const RestState& rest = *content.rest;
  GravitySegments segments;
  segments.acceleration = store.add(by_rows(*content.scene.gravity));
  std::vector<double> positions = by_rows(packed_rows(content.sites, rest.displacement));
  for (size_t i = 0; i < positions.size(); ++i) {
    const auto node = static_cast<size_t>(content.sites.packed_nodes[i / 3]);
    positions[i] += content.model.positions[node][static_cast<Eigen::Index>(i % 3)];
  }
  segments.rest_positions = store.add(positions);
  if (rest.per_gravity.size() == 0) return segments;
  const Eigen::MatrixXd per_gravity = packed_rows(content.sites, rest.per_gravity);
  std::vector<pack::Real> field;
  for (size_t panel = 0; panel < num_panels(content.sites); ++panel) append_panel(per_gravity, panel, field);
  segments.field_per_gravity = store.add(field);
  std::vector<double> contact;
  for (const int node : content.sites.contact_nodes) {
    const std::vector<double> rows = by_rows(per_gravity.middleRows<3>(3 * node));
    contact.insert(contact.end(), rows.begin(), rows.end());
  }
  segments.contact_per_gravity = store.add(contact);
  return segments;
}

SurfaceSegments add_surface(const PackContent& content, SegmentStore& store) {
  const SurfaceBvh bvh = build_surface_bvh(at_rest(content), extract_surface(content.model), content.sites);
  return {static_cast<uint32_t>(bvh.primitives.size()),
          static_cast<uint32_t>(bvh.nodes.size()),
          store.add(bvh.primitives),
          store.add(bvh.nodes),
          store.add(bvh.primitive_normals),
          store.add(bvh.site_normals)};
}

flatbuffers::Offset<pack::Geometry> create_geometry(const PackContent& content,
                                                    const GeometrySegments& geometry, uint64_t base,
                                                    flatbuffers::FlatBufferBuilder& builder) {
  const pack::Segment labels = placed(geometry.labels, base);
  const pack::Segment positions = placed(geometry.positions, base);
  const pack::Segment triangles = placed(geometry.triangles, base);
  return pack::CreateGeometry(
      builder, static_cast<uint32_t>(content.sites.packed_nodes.size()), &labels, &positions,
      static_cast<uint32_t>(content.sites.triangles.size()), &triangles, content.sites.mean_surface_edge,
      static_cast<uint32_t>(content.model.num_nodes()), static_cast<uint32_t>(content.model.elements.size()));
}

flatbuffers::Offset<pack::ContactSites> create_sites(const PackContent& content, const SiteSegments& sites,
                                                     uint64_t base, flatbuffers::FlatBufferBuilder& builder) {
  const pack::Segment contact_nodes = placed(sites.contact_nodes, base);
  const pack::Segment site_nodes = placed(sites.site_nodes, base);
  const pack::Segment patch_starts = placed(sites.patch_starts, base);
  const pack::Segment patch_nodes = placed(sites.patch_nodes, base);
  const pack::Segment inward_normals = placed(sites.inward_normals, base);
  return pack::CreateContactSites(builder, static_cast<uint32_t>(content.sites.contact_nodes.size()),
                                  &contact_nodes, static_cast<uint32_t>(content.sites.sites.size()),
                                  &site_nodes, &patch_starts, &patch_nodes, content.scene.tip_radius,
                                  content.scene.max_displacement,
                                  static_cast<uint32_t>(content.scene.max_contacts),
                                  content.scene.directions == Directions::inward ? &inward_normals : nullptr);
}

flatbuffers::Offset<pack::Gravity> create_gravity(const PackContent& content, const GravitySegments& gravity,
                                                  uint64_t base, flatbuffers::FlatBufferBuilder& builder) {
  const pack::Segment acceleration = placed(gravity.acceleration, base);
  const pack::Segment rest_positions = placed(gravity.rest_positions, base);
  const pack::Segment field_per_gravity = placed(gravity.field_per_gravity, base);
  const pack::Segment contact_per_gravity = placed(gravity.contact_per_gravity, base);
  // The runtime needs linear_dd to turn gravity; packs of a study may lack linear_dd.
  const bool may_turn = content.scene.gravity_may_turn && content.has_linear();
  return pack::CreateGravity(builder, &acceleration, &rest_positions, may_turn ? &field_per_gravity : nullptr,
                             may_turn ? &contact_per_gravity : nullptr);
}

flatbuffers::Offset<pack::SurfaceBvh> create_surface(const SurfaceSegments& surface, uint64_t base,
                                                     flatbuffers::FlatBufferBuilder& builder) {
  const pack::Segment primitives = placed(surface.primitives, base);
  const pack::Segment nodes = placed(surface.nodes, base);
  const pack::Segment primitive_normals = placed(surface.primitive_normals, base);
  const pack::Segment site_normals = placed(surface.site_normals, base);
  return pack::CreateSurfaceBvh(builder, surface.num_primitives, &primitives, surface.num_nodes, &nodes,
                                &primitive_normals, &site_normals);
}

}  // namespace palpate
