#include "runtime/src/pack/linear_open.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/pack/compliance.hpp"
#include "runtime/src/pack/compressed_open.hpp"
#include "runtime/src/pack/number_checks.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

// A symmetric positive definite compliance has a_ij^2 <= a_ii a_jj for every pair. contact_stiffness.cpp
// finds an inverse for any matrix that passes this check.
bool is_compliance(const double* blocks, uint64_t num_nodes) {
  constexpr double kRounding = 1e-9;
  const auto diagonal = [&](uint64_t node, uint64_t axis) {
    return blocks[9 * pack::lower_block(node, node) + 4 * axis];
  };
  bool is_valid = true;
  for (uint64_t i = 0; i < num_nodes; ++i) {
    const double* block = blocks + 9 * pack::lower_block(i, 0);
    for (uint64_t j = 0; j <= i; ++j, block += 9) {
      for (uint64_t a = 0; a < 3; ++a) {
        for (uint64_t b = 0; b < 3; ++b) {
          const double entry = block[3 * a + b];
          const double bound = diagonal(i, a) * diagonal(j, b) * (1.0 + kRounding);
          is_valid = is_valid && entry * entry <= bound && (i != j || entry == block[3 * b + a]);
        }
      }
    }
    if (!is_valid) return false;
  }
  return true;
}

// Call read_compliance() first, because a node's own compliance bounds its forces.
bool read_site_forces(const pack::Segment* segment, uint64_t first_offset, bool trusted, pal_pack& pack) {
  const uint32_t num_entries = pack.patch_starts[pack.num_sites];
  pack.site_forces = array_of<double>(pack, segment, first_offset, uint64_t{9} * num_entries);
  if (pack.site_forces == nullptr) return false;
  for (uint32_t entry = 0; entry < num_entries && !trusted; ++entry) {
    const uint32_t node = pack.patch_nodes[entry];
    double own[9];
    contact_compliance(pack, node, node, own);
    for (uint32_t row = 0; row < 3; ++row) {
      if (!all_within(pack.site_forces + size_t{9} * entry + size_t{3} * row, 3,
                      kLargestNodalForce / own[4 * row]))
        return false;
    }
  }
  return true;
}

bool read_compliance(const pack::LinearDd& linear, uint64_t first_offset, bool trusted, pal_pack& pack) {
  if (linear.compressed() != nullptr) {
    return linear.contact_compliance() == nullptr && linear.field_compliance() == nullptr &&
           read_compressed(*linear.compressed(), first_offset, trusted, pack);
  }
  const uint64_t num_contact_nodes = pack.num_contact_nodes;
  const uint64_t column = uint64_t{pack::num_panels(pack.num_nodes)} * 3 * pack::kPanelRows;
  pack.contact_compliance = array_of<double>(pack, linear.contact_compliance(), first_offset,
                                             9 * pack::lower_block(num_contact_nodes, 0));
  pack.field_compliance =
      array_of<pal_real>(pack, linear.field_compliance(), first_offset, num_contact_nodes * column);
  if (pack.contact_compliance == nullptr || pack.field_compliance == nullptr) return false;
  if (trusted) return true;
  for (uint64_t node = 0; node < num_contact_nodes; ++node) {
    const double* block = pack.contact_compliance + 9 * pack::lower_block(node, node);
    double largest = 0;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const double diagonal = block[4 * axis];
      if (!is_own_compliance(pack, diagonal)) return false;
      if (diagonal > largest) largest = diagonal;
    }
    if (!all_within(pack.field_compliance + node * column, column,
                    static_cast<pal_real>(kLargestAmplification * largest)))
      return false;
  }
  return is_compliance(pack.contact_compliance, num_contact_nodes);
}

}  // namespace

bool read_linear(const pack::LinearDd& linear, uint64_t first_offset, bool trusted, pal_pack& pack) {
  return read_compliance(linear, first_offset, trusted, pack) &&
         read_site_forces(linear.site_forces(), first_offset, trusted, pack);
}

bool read_gravity(const pack::Gravity& gravity, uint64_t first_offset, bool trusted, pal_pack& pack) {
  const uint64_t dofs = uint64_t{3} * pack.num_nodes;
  const double* acceleration = array_of<double>(pack, gravity.acceleration(), first_offset, 3);
  pack.rest_positions = array_of<double>(pack, gravity.rest_positions(), first_offset, dofs);
  if (acceleration == nullptr || pack.rest_positions == nullptr) return false;
  if (!all_within(acceleration, 3, kLargestScale) || !all_within(pack.rest_positions, dofs, kLargestScale))
    return false;
  pack.has_gravity = true;
  memcpy(pack.acceleration, acceleration, sizeof pack.acceleration);
  const double square = acceleration[0] * acceleration[0] + acceleration[1] * acceleration[1] +
                        acceleration[2] * acceleration[2];
  if (!is_scale(sqrt(square))) return false;
  if (gravity.field_per_gravity() == nullptr && gravity.contact_per_gravity() == nullptr) return true;
  const uint64_t rows = uint64_t{pack::num_panels(pack.num_nodes)} * pack::kPanelRows;
  const uint64_t contacts = uint64_t{9} * pack.num_contact_nodes;
  pack.field_per_gravity = array_of<pal_real>(pack, gravity.field_per_gravity(), first_offset, 3 * rows);
  pack.contact_per_gravity = array_of<double>(pack, gravity.contact_per_gravity(), first_offset, contacts);
  if (pack.field_per_gravity == nullptr || pack.contact_per_gravity == nullptr) return false;
  // The limit keeps nodes within kLargestScale under the largest gravity of a session.
  const double limit = kLargestScale / sqrt(square);
  return trusted || (all_within(pack.field_per_gravity, 3 * rows, static_cast<pal_real>(limit)) &&
                     all_within(pack.contact_per_gravity, contacts, limit));
}

}  // namespace palpate
