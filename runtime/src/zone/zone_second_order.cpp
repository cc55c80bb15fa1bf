#include "runtime/src/zone/zone_second_order.hpp"

#include "runtime/src/zone/zone_elements.hpp"

namespace palpate {

// By central differences of P, with stretches 1 + h: of second order, by the W of element_batch.hpp,
//
//   P_1 = lambda (h_1 + h_2 + h_3) h_1 + lambda/2 h.h + 3 mu h_1^2 + nu1/2 (h_1 + h_2 + h_3)^2
//         + nu2 (h.h + 2 h_1 (h_1 + h_2 + h_3)) + 4 nu3 h_1^2
SecondOrderLaw second_order_law(const pack::ZoneMaterial& material) {
  constexpr double kStep = 1e-3;
  if (material.law == pack::ZoneLaw::linear_elastic) return {};
  const auto differ = [&](double first, double others, size_t axis, double& slope) {
    const double there[3] = {1 + kStep * first, 1 + kStep * others, 1 + kStep * others};
    const double back[3] = {1 - kStep * first, 1 - kStep * others, 1 - kStep * others};
    const double forward = principal_stress(material, there, axis);
    const double backward = principal_stress(material, back, axis);
    slope = (forward - backward) / (2 * kStep);
    return (forward + backward) / (2 * kStep * kStep);
  };
  double along;
  double across;
  double of_others;
  const double a = differ(1, 0, 0, along);
  const double b = differ(1, 0, 1, across);
  const double c = differ(0, 1, 0, of_others);
  SecondOrderLaw law;
  law.lambda = across;
  law.mu = 0.5 * (along - across);
  law.nu1 = c - 2 * b;
  law.nu2 = b - 0.5 * (law.lambda + law.nu1);
  law.nu3 = 0.25 * (a - 1.5 * law.lambda - 3 * law.mu - 0.5 * law.nu1 - 3 * law.nu2);
  return law;
}

bool has_second_order(const pal_pack& pack, const pack::ZoneElement& element) {
  return element.volume_patch == pack::kNoPatch &&
         pack.zone_materials[element.material].law != pack::ZoneLaw::linear_elastic;
}

template <int kNodes>
bool set_rim_element(const pal_pack& pack, const pack::ZoneElement& element, const int nodes[kNodes],
                     const SecondOrderLaw& law, int lane, RimBatch<kNodes>& batch) {
  batch.law.lambda.set(lane, law.lambda);
  batch.law.mu.set(lane, law.mu);
  batch.law.nu1.set(lane, law.nu1);
  batch.law.nu2.set(lane, law.nu2);
  batch.law.nu3.set(lane, law.nu3);
  return set_shape(pack.zone_nodes, element, nodes, lane, batch.elements);
}

template <int kNodes>
double add_second_order(const RimBatch<kNodes>* batches, uint32_t count, const double* a, const double* b,
                        double* forces) {
  const BatchKernels<kNodes>& kernels = batch_kernels<kNodes>();
  DyadicLanes as_it_is = {};
  for (int lane = 0; lane < kLanes; ++lane) as_it_is.identity.set(lane, 1);
  double largest = 0;
  for (uint32_t n = 0; n < count; ++n) {
    const ElementBatch<kNodes>& elements = batches[n].elements;
    const NodalLanes<kNodes> of_a = gather(elements, a);
    const NodalLanes<kNodes> of_b = gather(elements, b);
    NodalLanes<kNodes> sums = {};
    for (const auto& point : elements.points) {
      KinematicsLanes kinematics;
      KinematicsLanes other;
      KinematicsLanes stressed = {};  // P in the place of F
      Lanes squares;
      kernels.deform(point, of_a, kinematics);
      kernels.deform(point, of_b, other);
      kernels.find_second_order(batches[n].law, kinematics.F, other.F, stressed.F, squares);
      kernels.add_force(point, stressed, as_it_is, sums);
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!(squares[lane] <= largest)) largest = squares[lane];
      }
    }
    scatter<kNodes>(elements, kLanes, sums, forces);
  }
  return largest;
}

template bool set_rim_element<4>(const pal_pack&, const pack::ZoneElement&, const int[4],
                                 const SecondOrderLaw&, int, RimBatch<4>&);
template bool set_rim_element<10>(const pal_pack&, const pack::ZoneElement&, const int[10],
                                  const SecondOrderLaw&, int, RimBatch<10>&);
template double add_second_order<4>(const RimBatch<4>*, uint32_t, const double*, const double*, double*);
template double add_second_order<10>(const RimBatch<10>*, uint32_t, const double*, const double*, double*);

}  // namespace palpate
