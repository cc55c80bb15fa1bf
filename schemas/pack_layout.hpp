// The bytes of a pack file around its FlatBuffer: what writer and reader must agree on and the schema cannot
// say.
//
//   0      PackHeader, 64 bytes
//   64     FlatBuffer tables (pack.fbs), padded with zeros to a multiple of 64
//   ...    segments, each starting on a multiple of 64, padded with zeros
//
// Part of the format: changing anything here changes kFormatVersion.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "schemas/monomials.hpp"

namespace palpate::pack {

inline constexpr uint64_t kAlignment = 64;  // a cache line, and the widest vector register
inline constexpr char kMagic[8] = {'P', 'A', 'L', 'P', 'A', 'T', 'E', '\0'};
inline constexpr uint32_t kFormatVersion = 17;
inline constexpr uint32_t kPanelNodes = 32;
inline constexpr uint32_t kPanelRows =
    3 * kPanelNodes;                           // dofs whose coefficients lie together in a field panel
inline constexpr uint32_t kMaxDegree = 14;     // of a displacement polynomial
inline constexpr uint32_t kMostRank = 96;      // of a site's basis
inline constexpr int kBasisUnit = 32767;       // 1 in columns of int16
inline constexpr uint32_t kSurveyBins = 4;     // at most, of |d| / max_displacement
inline constexpr uint32_t kMostContacts = 64;  // of a session, and that a scene may ask for

// Of displacement fields (Pack::real_bytes).
#if defined(PALPATE_FLOAT64) && PALPATE_FLOAT64
using Real = double;
#else
using Real = float;
#endif

struct PackHeader {
  char magic[8];
  uint32_t format_version;
  uint32_t header_bytes;   // 64
  uint64_t tables_offset;  // 64
  uint64_t tables_bytes;   // of the FlatBuffer, without padding
  uint64_t file_bytes;
  uint64_t
      checksum;  // XXH3-64 of all bytes after the header, seeded with XXH3-64 of the header with this field 0
  uint8_t reserved[16];  // zero
};
static_assert(sizeof(PackHeader) == kAlignment);

// A site of PolynomialDd.
struct PolynomialSite {
  double to_unit[9];            // A, row-major; 1 / length unit
  double min_jacobian;          // smallest det F of any element in its samples that lie in the domain
  double basis_error;           // max |u of L, B and C - u as it was fitted| / |d|, over the sampled domain
  uint64_t energy_start;        // in `energy`, numbers
  uint64_t coefficients_start;  // in `coefficients`, numbers
  uint64_t field_start;         // in `field`, bytes; a multiple of 64
  uint32_t degree;
  uint32_t rank;  // columns of B
  // Nonlinear solves that its sampling took, fitted to or not; 0: these are its derivatives at rest (affine_site)
  uint32_t samples;
  float linear_unit;  // length unit; an int16 i of L is i linear_unit / kBasisUnit; 0 where L is real
};
static_assert(sizeof(PolynomialSite) == 128);

// A node of SurfaceBvh. Nodes lie in depth-first order, node 0 the root: an interior node's left child
// follows it, then the left child's whole subtree, then the right child. Leaves count the primitives up in
// the same order. Bounds hold all corners of the primitives below, rounded outward from float64.
struct BvhNode {
  float min[3];
  uint32_t first;  // interior: the right child; leaf: the first of its primitives
  float max[3];
  uint32_t count;  // interior: 0; leaf: its primitives
};
static_assert(sizeof(BvhNode) == 32);

inline constexpr uint32_t kMostLeafPrimitives = 4;
inline constexpr uint32_t kMostBvhDepth = 48;  // edges from the root to a leaf: what a search has to remember

// A panel of CompressedCompliance.
struct CompressedPanel {
  uint32_t nodes[kPanelNodes];  // packed nodes; from the first kNoNode on there are no more
  uint32_t first_column;        // in the basis
  uint32_t num_columns;
};
static_assert(sizeof(CompressedPanel) == 136);

inline constexpr uint32_t kNoNode = 0xffffffffu;

// What a contact node's unit forces do to a panel.
struct CompressedBlock {
  uint32_t start;  // of its coefficients, in units of kBlockUnit numbers
  uint32_t rank;   // a multiple of kRankStep; kPanelRows: displacements as they are
};
static_assert(sizeof(CompressedBlock) == 8);

inline constexpr uint32_t kBlockUnit = 4;  // numbers
inline constexpr uint32_t kRankStep = 4;   // 3 kRankStep numbers are whole units

// A node of NonlinearZone.
struct ZoneNode {
  double position[3];      // in the mesh
  double displacement[3];  // from there to rest: zero without gravity
  uint32_t packed_node;    // kNoNode: not shown
  uint32_t free_axes;      // bits 0 to 2: axes along which the model does not hold it
  uint32_t first_element;  // of it, in the list of elements by node
  uint32_t num_elements;   // of it, in the table
  uint32_t num_outside;    // of it, beyond the table
  // Its place among the rows of the exterior; kNoNode: fixed, or neither packed nor in a zone where nothing is `between`.
  uint32_t row;
};
static_assert(sizeof(ZoneNode) == 72);

inline constexpr uint32_t kZoneElementNodes = 10;

// An element of NonlinearZone: a tetrahedron of four or ten nodes, in the order of C3D4 and C3D10.
struct ZoneElement {
  uint32_t nodes[kZoneElementNodes];  // of NonlinearZone; those beyond num_nodes are 0
  uint32_t num_nodes;                 // 4 or 10
  uint32_t material;
  // Elements of the same number share their volume change (offline/fem/shared_volumes.hpp) and follow one another,
  // numbers ascending; kNoPatch, behind them: each point its own.
  uint32_t volume_patch;
};
static_assert(sizeof(ZoneElement) == 52);
inline constexpr uint32_t kNoPatch = UINT32_MAX;
// Nodes of all elements of a volume patch, those of several counted as often.
inline constexpr uint32_t kMostPatchNodes = 128;

// W as in dyadic_tangent.hpp and isotropic_law.hpp.
enum class ZoneLaw : uint32_t {
  compressible_neo_hookean = 0,  // mu, lambda
  yeoh = 1,                      // C10, C20, C30, 1 / D1, 1 / D2, 1 / D3
  ogden = 2,                     // mu of three terms (0: none), alpha of them, 1 / D1, 1 / D2, 1 / D3
  st_venant_kirchhoff = 3,       // mu, lambda
  linear_elastic = 4             // mu, lambda
};
inline constexpr uint32_t kZoneLaws = 5;
inline constexpr uint32_t kZoneConstants = 9;

struct ZoneMaterial {
  ZoneLaw law;
  uint32_t reserved;
  double constants[kZoneConstants];  // those beyond the law's are 0
};
static_assert(sizeof(ZoneMaterial) == 80);

// Of the fields outside of a zone: monomials of degree 2 and up (monomials.hpp), to one of these.
inline constexpr uint32_t kLeastZoneDegree = 3;
inline constexpr uint32_t kMostZoneDegree = 5;
// What pairs weigh of a site's: those to the least degree.
inline constexpr uint32_t kPairColumns = num_monomials(2, kLeastZoneDegree);

inline constexpr uint32_t kMostMutualSites =
    128;  // what pairs of them add grows with their square; more have none
inline constexpr uint32_t kMostPairFields = 24;  // of a pair's own; a multiple of 4
inline constexpr int kPairUnit = 127;            // in an int8 of theirs: the scene's largest displacement

inline constexpr uint32_t kMostZoneRings = 8;
inline constexpr uint32_t kMostZoneContacts = 8;  // of a session, whose zones
// answer with at most so many nodes fixed while running: all are on the boundary of every zone, whose square a frame
// costs.
inline constexpr uint32_t kMostZoneFixed = 32;

constexpr uint64_t round_up(uint64_t bytes, uint64_t multiple) {
  return (bytes + multiple - 1) / multiple * multiple;
}

// Place of block (i, j), i >= j, among the blocks of a symmetric matrix of which the lower half is stored by
// rows.
constexpr uint64_t lower_block(uint64_t i, uint64_t j) {
  return i * (i + 1) / 2 + j;
}

// i and j of that place.
constexpr void find_lower_block(uint32_t place, uint32_t& i, uint32_t& j) {
  for (i = 0; place > i; ++i) place -= i + 1;
  j = place;
}

// A panel of columns that are int16, three or more: the first two by turns, [96][2], the third alone, [96], and all
// others two by turns, [pairs][96][2], the last of an odd number of them beside one of zeros. Each a number of cache lines.
constexpr uint32_t num_column_pairs(uint32_t columns) {
  return (columns - 3 + 1) / 2;
}
constexpr uint32_t rounded_panel_numbers(uint32_t columns) {
  return kPanelRows * (3 + 2 * num_column_pairs(columns));
}
// Where the entry of a column and one of the 96 rows is.
constexpr uint32_t rounded_place(uint32_t column, uint32_t row) {
  if (column < 2) return 2 * row + column;
  if (column == 2) return 2 * kPanelRows + row;
  return rounded_panel_numbers(column - (column - 3) % 2) + 2 * row + (column - 3) % 2;
}

// Of a panel of so many columns of a field.
constexpr uint64_t field_panel_bytes(uint32_t columns, bool rounded) {
  return rounded ? sizeof(int16_t) * rounded_panel_numbers(columns)
                 : sizeof(Real) * kPanelRows * uint64_t{columns};
}

constexpr uint32_t num_panels(uint32_t num_nodes) {
  return (num_nodes + kPanelNodes - 1) / kPanelNodes;
}

}  // namespace palpate::pack
