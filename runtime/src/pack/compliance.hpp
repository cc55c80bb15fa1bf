// The compliance of a pack: displacement of a packed node per unit force at a contact node. The compliance
// consists of blocks of K^-1 at rest, Zhong et al. 2005 eqs. (16)-(19).
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/numerics/field_kernel.hpp"

namespace palpate {

// Forces at contact nodes.
struct NodalForces {
  uint32_t count;
  const uint32_t* nodes;
  const pal_real* weights;  // [count][3]
};

// A_ij, 3 x 3 by rows: displacement of contact node i per unit force at contact node j. A_ji is its
// transpose, to the bit.
void contact_compliance(const pal_pack& pack, uint32_t i, uint32_t j, double block[9]);

// Writes the displacements of `count` panels from `first` on under nodal forces to sum[96 count], or adds the
// displacements if `onto`. Needs a dense compliance. Cost: reads 288 numbers a panel and loaded node.
void fill_compliance_field(const pal_pack& pack, const NodalForces& forces, uint32_t first, uint32_t count,
                           const FieldKernel& kernel, bool onto, pal_real* sum);

}  // namespace palpate
