// Makes the tangent of a group in slices: assembly, elimination, and the sensitivities to the contact axes.
//
// A rigid patch has three displacement axes, and three rotations if patches turn: dw moves a node with arm a
// by dw x a. The contact axes c follow the unknowns u of interior and boundary nodes:
//
//   [ K_uu   .   ]        [ L         .       ]
//   [ K_cu  K_cc ]  ->    [ X   K_cc - X X^T  ]    after elimination of u
//
// K is the stiffness of the group's elements and of the exterior, S. K_cc - X X^T is the stiffness that a
// tool feels. The sensitivities are X L^-1 = K_cu K_uu^-1 = - (du/dc)^T. advance_tangent() raises the
// diagonal of a K_uu that is not positive definite.
#pragma once

#include "runtime/src/base/progress.hpp"
#include "runtime/src/numerics/elimination.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

struct TangentMaker {
  uint32_t shift;        // failed attempts; each next attempt raises the diagonal more
  uint32_t columns;      // columns cleared and filled with S
  uint32_t parts;        // parts of the elements added
  bool is_assembled;     // fixed axes are dropped, and unit pivots and the shift are set
  uint32_t eliminated;   // columns eliminated
  uint32_t substituted;  // sensitivities computed
};

// Input of a tangent.
struct TangentSource {
  const pal_pack& pack;
  const EliminationKernel& kernel;
  const ZoneMembers& members;
  const GroupLayout& layout;
  const float* exterior;  // [boundary_stride][boundary_stride] S
  uint32_t num_parts;     // parts of the elements
  const void* elements;   // first argument of add_part()
  // Adds the stiffness of a part of the elements to the matrix. Returns multiply-adds.
  uint64_t (*add_part)(const void* elements, uint32_t part, float* matrix);
};

// Works until `spent` reaches `operations` multiply-adds. matrix[size rounded to columns][stride];
// rows[num_axes][unknowns]: sensitivities. Fails if K_uu with every shift is not positive definite, or if
// K_cc - X X^T is not finite.
Progress advance_tangent(const TangentSource& source, uint64_t operations, float* matrix, double* rows,
                         TangentMaker& maker, uint64_t& spent);

}  // namespace palpate
