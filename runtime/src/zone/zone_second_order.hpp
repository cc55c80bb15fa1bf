// Elements of which second order in the displacements is all that counts (element_batch.hpp): those of rims.
#pragma once

#include <palpate/palpate.h>
#include <stdint.h>

#include "runtime/kernels/element_batch.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

// Constants of what a law has of second order at small stretches. None where it is linear.
struct SecondOrderLaw {
  double lambda;
  double mu;
  double nu1;
  double nu2;
  double nu3;
};

SecondOrderLaw second_order_law(const pack::ZoneMaterial& material);

// Whether an element has any of its own.
bool has_second_order(const pal_pack& pack, const pack::ZoneElement& element);

template <int kNodes>
struct RimBatch {
  ElementBatch<kNodes> elements;  // nodes: places in the rim's list
  SecondOrderLanes law;
};

// Puts an element in a lane of one. False where it is inverted in the mesh.
template <int kNodes>
bool set_rim_element(const pal_pack& pack, const pack::ZoneElement& element, const int nodes[kNodes],
                     const SecondOrderLaw& law, int lane, RimBatch<kNodes>& batch);

// Adds n2(a, b) of the elements to forces, all [nodes][3], and returns the largest |gradient|^2 of (a + b) / 2. Cost: as
// their forces.
template <int kNodes>
double add_second_order(const RimBatch<kNodes>* batches, uint32_t count, const double* a, const double* b,
                        double* forces);

}  // namespace palpate
