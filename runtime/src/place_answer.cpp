#include "runtime/src/place_answer.hpp"

#include <string.h>

#include "runtime/src/linear_point.hpp"
#include "runtime/src/pack_view.hpp"
#include "runtime/src/polynomial_dd.hpp"

namespace palpate {

PlaceAnswer blend_polynomials(const pal_pack& pack, const ContactPlace& place, const double d[3],
                              FieldState& field) {
  PlaceAnswer blend = {};
  for (uint32_t i = 0; i < place.count; ++i) {
    const auto [site, weight] = place.corners[i];
    PolynomialFieldState& corner = field.corners[field.num_corners++];
    PolynomialAnswer answer;
    evaluate_polynomial(pack, site, d, answer, corner);
    corner.weight = static_cast<pal_real>(weight);
    blend.flags |= answer.flags;
    blend.energy += weight * answer.energy;
    for (int k = 0; k < 3; ++k) blend.force[k] += weight * answer.force[k];
    for (int k = 0; k < 9; ++k) blend.stiffness[k] += weight * answer.stiffness[k];
  }
  return blend;
}

PlaceAnswer move_to_place(const pal_pack& pack, uint32_t site, const ContactPlace& place, const double d[3],
                          FieldState& field) {
  const ContactPlace difference = difference_from(place, site);
  if (difference.count == 0) return {};
  if (pack.polynomial_sites != nullptr) return blend_polynomials(pack, difference, d, field);
  const uint32_t end = field.num_held + field.num_moved;
  LinearPointAnswer answer;
  field.num_moved +=
      evaluate_linear_point(pack, difference, d, answer, field.held + end, field.weights + size_t{3} * end);
  PlaceAnswer moved = {0, answer.energy, {}, {}};
  memcpy(moved.force, answer.force, sizeof moved.force);
  memcpy(moved.stiffness, answer.stiffness, sizeof moved.stiffness);
  return moved;
}

}  // namespace palpate
