// The bytes of a pack file around its FlatBuffer, which the schema cannot describe.
//
//   0      PackHeader, 64 bytes
//   64     FlatBuffer tables (pack.fbs), padded with zeros to a multiple of 64
//   ...    segments, each starting on a multiple of 64, padded with zeros
//
// A change of this file changes kFormatVersion.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "schemas/monomials.hpp"

namespace palpate::pack {

inline constexpr uint64_t kAlignment = 64;  // a cache line, and the widest vector register
inline constexpr char kMagic[8] = {'P', 'A', 'L', 'P', 'A', 'T', 'E', '\0'};
inline constexpr uint32_t kFormatVersion = 20;
inline constexpr uint32_t kPanelNodes = 32;
inline constexpr uint32_t kPanelRows = 3 * kPanelNodes;  // dofs with adjacent coefficients in a field panel
inline constexpr uint32_t kMaxDegree = 14;               // degree of displacement polynomials
inline constexpr uint32_t kMostRank = 96;                // rank of a site's basis
inline constexpr int kBasisUnit = 32767;                 // 1 in columns of int16
inline constexpr uint32_t kSurveyBins = 4;               // largest number of bins, by |d| / max_displacement
inline constexpr uint32_t kMostContacts = 64;            // limit of a session and of a scene

// The type of displacement fields (Pack::real_bytes).
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
  uint64_t tables_bytes;   // size of the FlatBuffer, without padding
  uint64_t file_bytes;
  uint64_t checksum;     // XXH3-64 of the bytes after the header (pack_checksum.hpp)
  uint8_t reserved[16];  // zero
};
static_assert(sizeof(PackHeader) == kAlignment);

// A site of PolynomialDd.
struct PolynomialSite {
  double to_unit[9];            // A, row-major; 1 / length unit
  double min_jacobian;          // smallest det F of any element in the samples of the domain
  double basis_error;           // max |u by L, B and C - fitted u| / |d| over the sampled domain
  uint64_t energy_start;        // in `energy`, numbers
  uint64_t coefficients_start;  // in `coefficients`, numbers
  uint64_t field_start;         // in `field`, bytes; a multiple of 64
  uint32_t degree;
  uint32_t rank;  // columns of B
  // Nonlinear solves for this site; 0: the polynomial holds derivatives at rest (affine_site)
  uint32_t samples;
  float linear_unit;  // length unit; an int16 i of L means i linear_unit / kBasisUnit; 0 if L is real
};
static_assert(sizeof(PolynomialSite) == 128);

// A node of SurfaceBvh. Nodes are in depth-first order from the root, node 0: an interior node, its left
// subtree, its right subtree. Leaves number the primitives in the same order. Bounds contain all corners of
// the subtree's primitives, rounded outward from float64.
struct BvhNode {
  float min[3];
  uint32_t first;  // interior: the right child; leaf: its first primitive
  float max[3];
  uint32_t count;  // interior: 0; leaf: its number of primitives
};
static_assert(sizeof(BvhNode) == 32);

inline constexpr uint32_t kMostLeafPrimitives = 4;
inline constexpr uint32_t kMostBvhDepth = 48;  // edges from the root to a leaf: the size of a search's stack

// A panel of CompressedCompliance.
struct CompressedPanel {
  uint32_t nodes[kPanelNodes];  // packed nodes; kNoNode ends the list
  uint32_t first_column;        // its first column in the basis
  uint32_t num_columns;
};
static_assert(sizeof(CompressedPanel) == 136);

inline constexpr uint32_t kNoNode = 0xffffffffu;

// The displacement of a panel under unit forces at a contact node.
struct CompressedBlock {
  uint32_t start;  // start of its coefficients, in units of kBlockUnit numbers
  uint32_t rank;   // a multiple of kRankStep; kPanelRows: the displacements themselves
};
static_assert(sizeof(CompressedBlock) == 8);

inline constexpr uint32_t kBlockUnit = 4;  // numbers
inline constexpr uint32_t kRankStep = 4;   // 3 kRankStep numbers are whole units

// A node of Organ.
struct OrganNode {
  double position[3];      // position in the mesh
  double displacement[3];  // from the mesh position to rest: zero without gravity
  uint32_t packed_node;    // kNoNode: not packed
  uint32_t free_axes;      // bits 0 to 2: axes that the model leaves free
  uint32_t first_element;  // its first element in node_elements
  uint32_t num_elements;
};
static_assert(sizeof(OrganNode) == 64);

inline constexpr uint32_t kOrganElementNodes = 10;

// An element of Organ: a tetrahedron of four or ten nodes, in the order of C3D4 and C3D10.
struct OrganElement {
  uint32_t nodes[kOrganElementNodes];  // nodes of Organ; 0 from num_nodes on
  uint32_t num_nodes;                  // 4 or 10
  uint32_t material;
  // Elements of a volume patch share their volume change (offline/fem/shared_volumes.hpp) and are
  // consecutive. Patches ascend. Elements without a patch, kNoPatch, may stand between the patches.
  uint32_t volume_patch;
};
static_assert(sizeof(OrganElement) == 52);
inline constexpr uint32_t kNoPatch = UINT32_MAX;
// Limit of the sum of nodes over all elements of a volume patch.
inline constexpr uint32_t kMostPatchNodes = 128;

// A front of Organ: nodes that are eliminated together, its columns, and the nodes below them.
struct Front {
  uint32_t first_column;  // its first place in Organ::order
  uint32_t num_columns;
  uint32_t first_row;  // its first entry in Organ::rows
  uint32_t num_rows;
  uint32_t parent;  // the front that holds all its rows; kNoFront: a root
  uint32_t first_element;
  // Elements whose first eliminated node is a column of the front; front 0 also has elements without free
  // nodes
  uint32_t num_elements;
  uint32_t num_within;  // fronts of its subtree, including the front itself, which is the last
};
static_assert(sizeof(Front) == 32);
inline constexpr uint32_t kNoFront = UINT32_MAX;

// The energy W of each law: dyadic_tangent.hpp and isotropic_law.hpp.
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
  double constants[kZoneConstants];  // 0 beyond the law's constants
};
static_assert(sizeof(ZoneMaterial) == 80);

inline constexpr uint32_t kMostZoneRings = 8;
inline constexpr uint32_t kMostZoneContacts = 8;  // limit for a session with zones
// Limit of nodes fixed at run time in a zone. All these nodes are on the boundary of a zone, and the cost of
// a frame rises with the square of the boundary.
inline constexpr uint32_t kMostZoneFixed = 32;

constexpr uint64_t round_up(uint64_t bytes, uint64_t multiple) {
  return (bytes + multiple - 1) / multiple * multiple;
}

// The place of block (i, j), i >= j, in a symmetric matrix that stores its lower half by rows.
constexpr uint64_t lower_block(uint64_t i, uint64_t j) {
  return i * (i + 1) / 2 + j;
}

// A panel of three or more int16 columns, each part a number of cache lines:
// - the first two columns interleaved, [96][2],
// - the third column, [96],
// - pairs of other columns, [pairs][96][2]; zeros complete an odd number.
constexpr uint32_t num_column_pairs(uint32_t columns) {
  return (columns - 3 + 1) / 2;
}
constexpr uint32_t rounded_panel_numbers(uint32_t columns) {
  return kPanelRows * (3 + 2 * num_column_pairs(columns));
}
// The place of an entry, by column and row.
constexpr uint32_t rounded_place(uint32_t column, uint32_t row) {
  if (column < 2) return 2 * row + column;
  if (column == 2) return 2 * kPanelRows + row;
  return rounded_panel_numbers(column - (column - 3) % 2) + 2 * row + (column - 3) % 2;
}

// Bytes of a field panel with so many columns.
constexpr uint64_t field_panel_bytes(uint32_t columns, bool rounded) {
  return rounded ? sizeof(int16_t) * rounded_panel_numbers(columns)
                 : sizeof(Real) * kPanelRows * uint64_t{columns};
}

constexpr uint32_t num_panels(uint32_t num_nodes) {
  return (num_nodes + kPanelNodes - 1) / kPanelNodes;
}

}  // namespace palpate::pack
