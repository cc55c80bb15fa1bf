// The tables of a pack, a source file for each model. An add_* function stores the arrays of a table; a
// create_* function writes the table. `base`: offset of the store in the pack, in bytes.
#pragma once

#include <vector>

#include "offline/pack/pack_writer.hpp"
#include "offline/pack/segment_store.hpp"
#include "schemas/pack_generated.h"

namespace palpate {

struct GeometrySegments {
  pack::Segment labels, positions, triangles;
};
struct SiteSegments {
  pack::Segment contact_nodes, site_nodes, patch_starts, patch_nodes, inward_normals;
};
struct LinearSegments {
  pack::Segment contact_compliance, field_compliance, site_forces;
};
struct CompressedSegments {
  pack::Segment panels, node_places, basis, blocks, coefficients;
};
struct PolynomialSegments {
  pack::Segment sites, energy, coefficients, field;
};
struct GravitySegments {
  pack::Segment acceleration, rest_positions, field_per_gravity, contact_per_gravity;
};
struct SurfaceSegments {
  uint32_t num_primitives, num_nodes;
  pack::Segment primitives, nodes, primitive_normals, site_normals;
};
struct ZoneSegments {
  pack::Segment materials;
};
struct OrganSegments {
  uint32_t num_nodes, num_free, num_elements, num_fronts;
  pack::Segment nodes, elements, node_elements, fronts, order, rows;
};

// geometry_tables.cpp
GeometrySegments add_geometry(const Model& model, const ContactSites& sites, SegmentStore& store);
SiteSegments add_sites(const ContactSites& sites, Directions directions, SegmentStore& store);
GravitySegments add_gravity(const PackContent& content, SegmentStore& store);
SurfaceSegments add_surface(const PackContent& content, SegmentStore& store);
flatbuffers::Offset<pack::Geometry> create_geometry(const PackContent& content,
                                                    const GeometrySegments& geometry, uint64_t base,
                                                    flatbuffers::FlatBufferBuilder& builder);
flatbuffers::Offset<pack::ContactSites> create_sites(const PackContent& content, const SiteSegments& sites,
                                                     uint64_t base, flatbuffers::FlatBufferBuilder& builder);
flatbuffers::Offset<pack::Gravity> create_gravity(const PackContent& content, const GravitySegments& gravity,
                                                  uint64_t base, flatbuffers::FlatBufferBuilder& builder);
flatbuffers::Offset<pack::SurfaceBvh> create_surface(const SurfaceSegments& surface, uint64_t base,
                                                     flatbuffers::FlatBufferBuilder& builder);

// linear_tables.cpp
LinearSegments add_linear(const LinearDd& linear, const ContactSites& sites, SegmentStore& store);
CompressedSegments add_compressed(const CompressedCompliance& compressed, SegmentStore& store);
// Returns the nodal forces of each site's patch for a unit displacement of the patch.
std::vector<double> site_forces(const PackContent& content);
// Returns a null table where the content has no linear_dd.
flatbuffers::Offset<pack::LinearDd> create_linear(const PackContent& content, const LinearSegments& linear,
                                                  const CompressedSegments& compressed, uint64_t base,
                                                  flatbuffers::FlatBufferBuilder& builder);

// polynomial_tables.cpp
PolynomialSegments add_polynomials(const std::vector<SiteResult>& results, const ContactSites& contact_sites,
                                   bool rounded, SegmentStore& store);
flatbuffers::Offset<pack::PolynomialDd> create_polynomials(const PackContent& content,
                                                           const PolynomialSegments& polynomial,
                                                           uint64_t base,
                                                           flatbuffers::FlatBufferBuilder& builder);

// zone_tables.cpp
ZoneSegments add_zone(const PackContent& content, SegmentStore& store);
flatbuffers::Offset<pack::NonlinearZone> create_zone(const PackContent& content, const ZoneSegments& zone,
                                                     uint64_t base, flatbuffers::FlatBufferBuilder& builder);

// organ_tables.cpp
OrganSegments add_organ(const PackContent& content, SegmentStore& store);
flatbuffers::Offset<pack::Organ> create_organ(const OrganSegments& organ, uint64_t base,
                                              flatbuffers::FlatBufferBuilder& builder);

// survey_tables.cpp
std::vector<flatbuffers::Offset<pack::ErrorSurvey>> create_surveys(const PackContent& content,
                                                                   flatbuffers::FlatBufferBuilder& builder);
std::vector<flatbuffers::Offset<pack::FrameCost>> create_costs(const PackContent& content,
                                                               flatbuffers::FlatBufferBuilder& builder);

}  // namespace palpate
