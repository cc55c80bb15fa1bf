// Adds the stiffness of elements to a matrix, at the unknowns that move their nodes (ZoneUnknowns).
#pragma once

#include <string.h>

#include "runtime/src/elements/zone_elements.hpp"
#include "runtime/src/numerics/pose.hpp"

namespace palpate {

// Returns the index of entry (row, column), row >= column, in StiffnessLanes of an element.
constexpr size_t lower_place(size_t nodes, size_t row, size_t column) {
  return column * 3 * nodes - column * (column - 1) / 2 - column + row;
}
// The lower triangle of a column-major matrix, to which element stiffness is added.
struct Target {
  float* matrix;
  uint32_t stride;  // floats from column to column

  void add(uint32_t row, uint32_t column, double value) const {
    matrix[size_t{column} * stride + row] += static_cast<float>(value);
  }
  // Adds K_ab of two different nodes and, implied by symmetry, K_ba.
  void add_block(const double block[3][3], uint32_t row, uint32_t column, double factor) const {
    for (uint32_t i = 0; i < 3; ++i) {
      for (uint32_t k = 0; k < 3; ++k) {
        const double value = factor * block[i][k];
        if (row > column) {
          add(row + i, column + k, value);
        } else if (row < column) {
          add(column + k, row + i, value);
        } else {  // the same unknowns move both nodes: K_ab + K_ba
          add(row + (i > k ? i : k), row + (i > k ? k : i), i == k ? 2 * value : value);
        }
      }
    }
  }
  // Adds K_aa of one node.
  void add_diagonal(const double block[3][3], uint32_t row, double factor) const {
    for (uint32_t i = 0; i < 3; ++i) {
      for (uint32_t k = 0; k <= i; ++k) add(row + i, row + k, factor * block[i][k]);
    }
  }
};

// Calls use(first unknown, share, arm) for each three unknowns that move a node. arm: null for displacements.
template <typename Use>
void for_each_master(const ZoneUnknowns& unknowns, int node, Use&& use) {
  const uint32_t place = unknowns.place(node);
  const uint32_t unknown = unknowns.of_place[place];
  if (unknown == kNoUnknown) return;
  if (unknown != kHeldUnknown) {
    use(unknown, 1.0, nullptr);
    return;
  }
  for (uint32_t m = unknowns.first_master[place]; m < unknowns.first_master[place + 1]; ++m) {
    const ZoneMaster& master = unknowns.masters[m];
    use(master.unknown, master.share, nullptr);
    if (master.turn != kNoUnknown) use(master.turn, master.share, master.arm);
  }
}

// Replaces a nodal force by its moment arm x force, the generalised force on the patch rotation.
inline void take_moment(const double* arm, double force[3]) {
  double moment[3] = {};
  add_cross(arm, force, moment);
  memcpy(force, moment, sizeof moment);
}

// K := [row_arm]x K [column_arm]x^T. A null arm leaves its side unchanged.
inline void take_moments(const double* row_arm, const double* column_arm, double block[3][3]) {
  for (uint32_t i = 0; i < 3 && column_arm != nullptr; ++i) take_moment(column_arm, block[i]);
  for (uint32_t k = 0; k < 3 && row_arm != nullptr; ++k) {
    double column[3] = {block[0][k], block[1][k], block[2][k]};
    take_moment(row_arm, column);
    for (uint32_t i = 0; i < 3; ++i) block[i][k] = column[i];
  }
}

// Adds K_ab of two nodes of an element at all unknowns that move the nodes.
inline void scatter_block(const double block[3][3], int row_node, int column_node,
                          const ZoneUnknowns& unknowns, const Target& target) {
  for_each_master(unknowns, row_node, [&](uint32_t row, double row_share, const double* row_arm) {
    for_each_master(unknowns, column_node,
                    [&](uint32_t column, double column_share, const double* column_arm) {
                      const bool is_diagonal = row_node == column_node;
                      if (is_diagonal && row < column) return;
                      double moved[3][3];
                      memcpy(moved, block, sizeof moved);
                      take_moments(row_arm, column_arm, moved);
                      const double factor = row_share * column_share;
                      if (is_diagonal && row == column) {
                        target.add_diagonal(moved, row, factor);
                      } else {
                        target.add_block(moved, row, column, factor);
                      }
                    });
  });
}

// Adds an element with a held or fixed node. `stiffness`: indexed by lower_place().
inline void scatter_held(size_t nodes, const int* places, const Lanes* stiffness, int lane,
                         const ZoneUnknowns& unknowns, const Target& target) {
  for (size_t b = 0; b < nodes; ++b) {
    for (size_t a = b; a < nodes; ++a) {
      double block[3][3];
      for (size_t i = 0; i < 3; ++i) {
        for (size_t k = 0; k < 3; ++k) {
          const size_t row = 3 * a + i;
          const size_t column = 3 * b + k;
          block[i][k] = row >= column ? stiffness[lower_place(nodes, row, column)][lane]
                                      : stiffness[lower_place(nodes, column, row)][lane];
        }
      }
      scatter_block(block, places[a], places[b], unknowns, target);
    }
  }
}

// Adds an element without held or fixed nodes. first: [nodes] first unknown of each node.
inline void scatter_free(size_t nodes, const Lanes* stiffness, int lane, const uint32_t* first,
                         const Target& target) {
  for (size_t b = 0; b < nodes; ++b) {
    for (size_t k = 0; k < 3; ++k) {
      const size_t column = 3 * b + k;
      const Lanes* entries = stiffness + lower_place(nodes, 0, column);
      float* to = target.matrix + size_t{first[b] + static_cast<uint32_t>(k)} * target.stride;
      for (size_t i = k; i < 3; ++i) to[first[b] + i] += static_cast<float>(entries[3 * b + i][lane]);
      for (size_t a = b + 1; a < nodes; ++a) {
        if (first[a] > first[b]) {
          for (size_t i = 0; i < 3; ++i) to[first[a] + i] += static_cast<float>(entries[3 * a + i][lane]);
        } else {
          for (size_t i = 0; i < 3; ++i)
            target.matrix[size_t{first[a] + static_cast<uint32_t>(i)} * target.stride + first[b] + k] +=
                static_cast<float>(entries[3 * a + i][lane]);
        }
      }
    }
  }
}

// Adds the element of one lane. places: [nodes] its nodes, as ElementBatch::nodes.
inline void scatter_stiffness(size_t nodes, const int* places, const Lanes* stiffness, int lane,
                              const ZoneUnknowns& unknowns, const Target& target) {
  uint32_t first[kMostElementNodes];
  bool is_free = true;
  for (size_t a = 0; a < nodes; ++a) {
    first[a] = unknowns.of_place[unknowns.place(places[a])];
    is_free = is_free && first[a] < kHeldUnknown;
  }
  if (is_free) {
    scatter_free(nodes, stiffness, lane, first, target);
  } else {
    scatter_held(nodes, places, stiffness, lane, unknowns, target);
  }
}

}  // namespace palpate
