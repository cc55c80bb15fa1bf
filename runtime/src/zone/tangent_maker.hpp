// Makes the tangent of a group, in slices: assembly, elimination, and the sensitivities to the contact axes.
//
// A patch moves as one, so a contact is three unknowns, or six where patches turn: dw moves a node by dw x a, a its arm.
// The contacts c stand behind the unknowns u of interior and boundary:
//
//   [ K_uu   .   ]        [ L         .       ]
//   [ K_cu  K_cc ]  ->    [ X   K_cc - X X^T  ]    after elimination of u
//
// K is the stiffness of the group's elements and the block S of the exterior. K_cc - X X^T is the stiffness that a tool
// feels, and -X L^-1 says how u follows the contacts. Where K_uu is not positive definite, its diagonal is raised.
#pragma once

#include "runtime/src/base/progress.hpp"
#include "runtime/src/numerics/elimination.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

struct TangentMaker {
  uint32_t shift;        // attempts that failed, each with a smaller shift than the next
  uint32_t columns;      // columns that are cleared and have S
  uint32_t parts;        // parts of elements that are added
  bool is_assembled;     // fixed axes, unit pivots and the shift are in their places
  uint32_t eliminated;   // columns that are eliminated
  uint32_t substituted;  // sensitivities that are finished
};

// What a tangent is made from.
struct TangentSource {
  const EliminationKernel& kernel;
  const GroupLayout& layout;
  const float* exterior;  // [boundary_stride][boundary_stride] S
  uint32_t num_parts;     // of elements
  const void* elements;   // of the functions below
  // Adds the stiffness of a part of the elements to the matrix. Returns multiply-adds.
  uint64_t (*add_part)(const void* elements, uint32_t part, float* matrix);
  // Axes along which an interior or boundary node, by number, can move: bits 0 to 2.
  uint32_t (*moving_axes)(const void* elements, uint32_t node);
};

// Goes on for about so many multiply-adds in all. `matrix`: [size rounded to columns][stride]; `rows`: [num_axes][unknowns].
// Fails where K_uu is not positive definite with any shift, or the stiffness of the contacts is not finite.
Progress advance_tangent(const TangentSource& source, uint64_t operations, float* matrix, double* rows,
                         TangentMaker& maker, uint64_t& spent);

}  // namespace palpate
