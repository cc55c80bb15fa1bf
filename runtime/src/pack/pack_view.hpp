// An open pack: pointers to the checked bytes. Constant once open.
#pragma once

#include <palpate/palpate.h>
#include <stddef.h>
#include <stdint.h>

#include "schemas/pack_layout.hpp"

namespace palpate {

static_assert(sizeof(pack::Real) == sizeof(pal_real), "PALPATE_FLOAT64 is one for schemas and API");

// A bin of an error survey; ErrorBin in schemas/pack.fbs.
struct ErrorBinView {
  double to;  // upper end of |d| / max_displacement
  // The error bounds at the upper end, and their slopes per |d| / max_displacement towards the lower end.
  double displacement_bound;
  double displacement_slope;
  double force_bound;
  double force_slope;
};

inline constexpr uint32_t kNumModels = 5;  // response models of the schema that this library knows
// The survey of nonlinear_zone before the refining lane has corrected its exterior.
inline constexpr uint32_t kUnrefinedZone = 4;

struct SurveyView {
  uint32_t num_bins;  // 0: no survey of this model
  float force_scale;  // ErrorSurvey::force_scale
  ErrorBinView bins[pack::kSurveyBins];
  // Errors of contact sets, for sets of up to this many contacts; 0 in packs of older builders
  uint32_t most_contacts;
  double set_displacement_bound;
  double set_force_bound;
  double set_displacement_reach_bound;  // 0 in packs of older builders
  double set_force_reach_bound;
};

// The organ as a finite element model and the tree of its elimination; Organ in schemas/pack.fbs. `nodes` is
// null in a pack without zones. The materials are pal_pack::zone_materials.
struct OrganView {
  uint32_t num_nodes;
  uint32_t num_free;
  uint32_t num_elements;
  uint32_t num_quadratic;  // elements of ten nodes
  uint32_t num_fronts;
  uint32_t num_patches;  // volume patches
  const pack::OrganNode* nodes;
  const pack::OrganElement* elements;
  const uint32_t* node_elements;
  const pack::Front* fronts;
  const uint32_t* order;  // [num_free] node of each place in the elimination
  const uint32_t* rows;
};

}  // namespace palpate

struct pal_pack {
  const unsigned char* bytes;
  size_t num_bytes;
  bool mapped;          // the library mapped the file and unmaps the file
  uint32_t num_panels;  // length of compressed_panels

  // Geometry
  uint32_t num_nodes;
  uint32_t num_triangles;
  const int32_t* labels;
  const double* positions;
  const uint32_t* triangles;
  double mean_surface_edge;

  // ContactSites
  uint32_t num_contact_nodes;
  uint32_t num_sites;
  uint32_t max_patch_nodes;
  uint32_t max_contacts;
  const uint32_t* contact_nodes;
  const uint32_t* site_nodes;
  const uint32_t* patch_starts;
  const uint32_t* patch_nodes;
  const double* inward_normals;  // [num_sites][3] unit; null if the samples cover every direction
  double tip_radius;
  double max_displacement;

  // LinearDd; field_compliance is null without the model, and contact_compliance also for a compressed
  // compliance
  const double* contact_compliance;
  const pal_real* field_compliance;  // dense columns, or the coefficients of the blocks
  const palpate::pack::CompressedPanel* compressed_panels;  // [num_panels]; null for a dense compliance
  const uint32_t* node_places;                              // [num_nodes] 32 x panel + place in it
  const pal_real* compressed_basis;
  const palpate::pack::CompressedBlock* compressed_blocks;  // [num_contact_nodes][num_panels]
  const double* site_forces;                                // [patch_starts[num_sites]][3][3]

  // PolynomialDd; polynomial_sites is null without the model
  uint32_t degree;                                        // largest degree of any site
  bool basis_rounded;                                     // basis and L are int16
  const palpate::pack::PolynomialSite* polynomial_sites;  // [num_sites]
  const double* energy;
  const pal_real* coefficients;
  const unsigned char* polynomial_field;

  // NonlinearZone; zone_rings is 0 without it
  uint32_t zone_rings;
  uint32_t num_zone_nodes;     // of all sites' zones together
  uint32_t num_zone_elements;  // of all sites' zones together
  uint32_t most_zone_nodes;
  uint32_t most_zone_boundary;
  uint32_t most_zone_elements;
  uint32_t num_zone_materials;
  const palpate::pack::ZoneMaterial* zone_materials;

  palpate::OrganView organ;

  // SurfaceBvh; bvh_nodes is null without the tree
  uint32_t num_primitives;
  uint32_t num_bvh_nodes;
  const uint32_t* primitives;  // [num_primitives][3] sites
  const palpate::pack::BvhNode* bvh_nodes;
  const float* primitive_normals;  // [num_primitives][4][3] unit: face, edges opposite corners 0, 1, 2
  const float* site_normals;       // [num_sites][3] unit

  // Gravity; the last two pointers are null if gravity cannot turn
  bool has_gravity;
  double acceleration[3];
  const double* rest_positions;       // [num_nodes][3]; `positions` in a pack without gravity
  const pal_real* field_per_gravity;  // [panels][3][96]
  const double* contact_per_gravity;  // [num_contact_nodes][3][3]

  // Units: factors from model units to API units
  bool has_units;
  double metres;
  double newtons;

  palpate::SurveyView surveys[palpate::kNumModels];
};
