#include "offline/pack/pack_writer.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <new>
#include <optional>

#include "offline/pack/pack_tables.hpp"
#include "offline/precompute/surface_bvh.hpp"
#include "schemas/monomials.hpp"
#include "schemas/pack_checksum.hpp"
#include "schemas/pack_generated.h"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

struct PackSegments {
  GeometrySegments geometry;
  SiteSegments sites;
  LinearSegments linear;
  CompressedSegments compressed;
  PolynomialSegments polynomial;
  ZoneSegments zone;
  OrganSegments organ = {};
  std::optional<GravitySegments> gravity;
  SurfaceSegments surface = {};
  std::vector<pack::Segment> inputs;
};

PackSegments add_arrays(const PackContent& content, SegmentStore& store) {
  PackSegments segments;
  segments.geometry = add_geometry(content.model, content.sites, store);
  segments.sites = add_sites(content.sites, content.scene.directions, store);
  if (content.linear != nullptr) segments.linear = add_linear(*content.linear, content.sites, store);
  if (content.compressed != nullptr) segments.compressed = add_compressed(*content.compressed, store);
  if (content.has_linear()) segments.linear.site_forces = store.add(site_forces(content));
  if (content.polynomials != nullptr)
    segments.polynomial = add_polynomials(*content.polynomials, content.sites, content.rounded, store);
  if (content.zone != nullptr) segments.zone = add_zone(content, store);
  if (content.zone != nullptr) segments.organ = add_organ(content, store);
  if (content.rest != nullptr && !content.rest->is_mesh()) segments.gravity = add_gravity(content, store);
  segments.surface = add_surface(content, store);
  for (const InputFile& input : content.inputs) {
    if (content.scene.embed_inputs) segments.inputs.push_back(store.add(input.contents));
  }
  return segments;
}

void write_tables(const PackContent& content, const PackSegments& segments, uint64_t base,
                  flatbuffers::FlatBufferBuilder& builder) {
  std::vector<flatbuffers::Offset<pack::InputFile>> inputs;
  for (size_t i = 0; i < content.inputs.size(); ++i) {
    const InputFile& input = content.inputs[i];
    const std::string name = std::filesystem::path(input.path).filename().string();
    pack::Segment contents;
    if (content.scene.embed_inputs) contents = placed(segments.inputs[i], base);
    inputs.push_back(pack::CreateInputFileDirect(builder, name.c_str(), input.hash.c_str(),
                                                 input.path.c_str(),
                                                 content.scene.embed_inputs ? &contents : nullptr));
  }
  flatbuffers::Offset<pack::Units> units;
  if (!content.scene.length_unit.empty()) {
    units =
        pack::CreateUnitsDirect(builder, content.scene.length_unit.c_str(), content.scene.force_unit.c_str(),
                                content.scene.metres_per_length_unit, content.scene.newtons_per_force_unit);
  }
  const auto geometry_table = create_geometry(content, segments.geometry, base, builder);
  const auto sites_table = create_sites(content, segments.sites, base, builder);
  const auto linear_table = create_linear(content, segments.linear, segments.compressed, base, builder);
  flatbuffers::Offset<pack::PolynomialDd> polynomial_table;
  if (content.polynomials != nullptr)
    polynomial_table = create_polynomials(content, segments.polynomial, base, builder);
  flatbuffers::Offset<pack::NonlinearZone> zone_table;
  flatbuffers::Offset<pack::Organ> organ_table;
  if (content.zone != nullptr) zone_table = create_zone(content, segments.zone, base, builder);
  if (content.zone != nullptr) organ_table = create_organ(segments.organ, base, builder);
  const auto surface_table = create_surface(segments.surface, base, builder);
  flatbuffers::Offset<pack::Gravity> gravity_table;
  if (segments.gravity) gravity_table = create_gravity(content, *segments.gravity, base, builder);
  const auto surveys = create_surveys(content, builder);
  const auto costs = create_costs(content, builder);
  pack::FinishPackBuffer(
      builder, pack::CreatePackDirect(builder, PALPATE_VERSION, &inputs, units, geometry_table, sites_table,
                                      linear_table, polynomial_table, &surveys, &costs, surface_table,
                                      gravity_table, sizeof(pack::Real), zone_table, organ_table));
}

}  // namespace

AlignedBytes::AlignedBytes(size_t size)
    : data_(static_cast<unsigned char*>(::operator new(size, std::align_val_t(pack::kAlignment)))),
      size_(size) {
  std::memset(data_.get(), 0, size);
}

void AlignedBytes::Release::operator()(unsigned char* data) const {
  ::operator delete(data, std::align_val_t(pack::kAlignment));
}

AlignedBytes write_pack(const PackContent& content) {
  SegmentStore store;
  const PackSegments segments = add_arrays(content, store);
  // The size of the tables does not depend on `base`: the first pass measures, the second pass writes.
  flatbuffers::FlatBufferBuilder sizing;
  write_tables(content, segments, 0, sizing);
  const uint64_t base = pack::round_up(sizeof(pack::PackHeader) + sizing.GetSize(), pack::kAlignment);
  flatbuffers::FlatBufferBuilder tables;
  write_tables(content, segments, base, tables);

  AlignedBytes file(base + store.body().size());
  unsigned char* bytes = file.bytes().data();
  pack::PackHeader header = {};
  std::memcpy(header.magic, pack::kMagic, sizeof header.magic);
  header.format_version = pack::kFormatVersion;
  header.header_bytes = sizeof header;
  header.tables_offset = sizeof header;
  header.tables_bytes = tables.GetSize();
  header.file_bytes = file.bytes().size();
  std::memcpy(bytes, &header, sizeof header);
  std::memcpy(bytes + sizeof header, tables.GetBufferPointer(), tables.GetSize());
  std::memcpy(bytes + base, store.body().data(), store.body().size());
  header.checksum = pack::checksum_of(bytes, file.bytes().size());
  std::memcpy(bytes, &header, sizeof header);
  return file;
}

int highest_degree(const std::vector<SiteResult>& results) {
  int highest = 0;
  for (const SiteResult& result : results) highest = std::max(highest, result.polynomial.degree);
  return highest;
}

double estimate_pack_bytes(const ContactSites& sites, bool linear, PolynomialSize polynomials, bool rounded,
                           double tolerance) {
  const size_t packed_nodes = sites.packed_nodes.size();
  const size_t contact_nodes = sites.contact_nodes.size();
  const auto num_sites = static_cast<double>(sites.sites.size());
  const double rows =
      pack::num_panels(static_cast<uint32_t>(packed_nodes)) * static_cast<double>(pack::kPanelRows);
  // A closed surface has two triangles for each node, and its tree one node for each triangle.
  constexpr double kSurfaceBytesOfASite =
      2.0 * (sizeof(SurfaceBvh::primitives[0]) + sizeof(SurfaceBvh::primitive_normals[0]) +
             sizeof(pack::BvhNode)) +
      sizeof(PackedNormal);
  double bytes = 40.0 * static_cast<double>(packed_nodes) + 4096.0 + kSurfaceBytesOfASite * num_sites;
  if (linear) {
    bytes += tolerance > 0 ? estimate_compressed_bytes(packed_nodes, contact_nodes, tolerance)
                           : dense_compliance_bytes(packed_nodes, contact_nodes);
    for (const ContactSite& site : sites.sites)
      bytes += 9.0 * sizeof(double) * static_cast<double>(site.patch.size());
  }
  if (const auto [degree, rank] = polynomials; degree > 0) {
    const double panels = rows / pack::kPanelRows;
    const size_t tables = sizeof(pack::PolynomialSite) + sizeof(double) * pack::num_monomials(2, degree + 1) +
                          sizeof(pack::Real) * pack::num_monomials(2, degree) * rank;
    bytes += num_sites * (panels * static_cast<double>(pack::field_panel_bytes(3 + rank, rounded)) +
                          static_cast<double>(tables));
  }
  return bytes;
}

}  // namespace palpate
