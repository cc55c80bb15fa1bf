#include "runtime/src/response/response_at_point.hpp"

#include "runtime/src/linear/linear_point.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/polynomial/polynomial_dd.hpp"

namespace palpate {

PointResponse blend_polynomials(const pal_pack& pack, const ContactPlace& place, const double d[3],
                                FieldState& field) {
  PointResponse blend = {};
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

namespace {

// Adds `sign` times linear_dd at a difference of places.
void add_linear(const pal_pack& pack, const ContactPlace& difference, double sign, const double d[3],
                PointResponse& transfer, FieldState& field) {
  const double signed_d[3] = {sign * d[0], sign * d[1], sign * d[2]};
  const uint32_t end = field.num_held + field.num_moved;
  LinearPointAnswer answer;
  field.num_moved += evaluate_linear_point(pack, difference, signed_d, answer, field.held + end,
                                           field.weights + size_t{3} * end);
  transfer.energy += sign * answer.energy;
  for (int k = 0; k < 3; ++k) transfer.force[k] += answer.force[k];
  for (int k = 0; k < 9; ++k) transfer.stiffness[k] += sign * answer.stiffness[k];
}

}  // namespace

PointResponse transfer_to_place(const pal_pack& pack, uint32_t site, const ContactPlace& place,
                                const double d[3], FieldState& field) {
  const ContactPlace difference = difference_from(place, site);
  if (difference.count == 0) return {};
  if (pack.polynomial_sites != nullptr) return blend_polynomials(pack, difference, d, field);
  PointResponse transfer = {};
  add_linear(pack, difference, 1.0, d, transfer, field);
  return transfer;
}

PointResponse transfer_beyond_linear(const pal_pack& pack, uint32_t site, const ContactPlace& place,
                                     const double d[3], FieldState& field) {
  const ContactPlace difference = difference_from(place, site);
  if (difference.count == 0 || pack.polynomial_sites == nullptr) return {};
  PointResponse transfer = blend_polynomials(pack, difference, d, field);
  add_linear(pack, difference, -1.0, d, transfer, field);
  return transfer;
}

}  // namespace palpate
