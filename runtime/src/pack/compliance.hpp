// The compliance that a pack holds: displacement of a packed node per unit force at a contact node, blocks of
// K^-1 at rest, Zhong et al. 2005 eqs. (16)-(19).
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/numerics/field_kernel.hpp"

namespace palpate {

// Of contact or zone nodes.
struct NodalForces {
  uint32_t count;
  const uint32_t* nodes;
  const pal_real* weights;  // [count][3]
};

// A_ij, 3 x 3 by rows: displacement of contact node i per unit force at contact node j; A_ji is its
// transpose, to the bit. What is fetched from memory: two lines; of a compressed compliance some twenty.
void contact_compliance(const pal_pack& pack, uint32_t i, uint32_t j, double block[9]);

// sum[96 count] = displacements of the nodes of `count` panels from `first` on by nodal forces, onto what is there or
// not. The compliance is dense. Cost: reads 288 numbers for each panel and node with a force.
void fill_compliance_field(const pal_pack& pack, const NodalForces& forces, uint32_t first, uint32_t count,
                           const FieldKernel& kernel, bool onto, pal_real* sum);

}  // namespace palpate
