#include "runtime/src/polynomial_field.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/pack_view.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

constexpr uint32_t kMostMonomials = pack::num_monomials(0, pack::kMaxDegree);
constexpr uint32_t kTogether = 8;

// Weights as integers times one unit, which is returned: as small as leaves every sum of products in 32 bits. The last
// of an odd number is followed by 0.
pal_real round_weights(const pal_real* weights, uint32_t count, int16_t* integers) {
  // 32768 times it, and half a unit more for each of 96 roundings, is below 2^31.
  constexpr pal_real kMostSum = 65000;
  pal_real largest = 0;
  pal_real sum = 0;
  for (uint32_t k = 0; k < count; ++k) {
    const pal_real size = fabs(weights[k]);
    if (size > largest) largest = size;
    sum += size;
  }
  if (count % 2 != 0) integers[count] = 0;
  if (!isfinite(sum)) {  // a damaged pack that nobody verified: as without rounding
    memset(integers, 0, count * sizeof *integers);
    return sum;
  }
  const pal_real by_largest = largest / pack::kBasisUnit;
  const pal_real unit = by_largest > sum / kMostSum ? by_largest : sum / kMostSum;
  // Below what float32 has digits for there is nothing to show.
  constexpr pal_real kLeast = pal_real(1e-30);
  const pal_real per_unit = unit > kLeast ? 1 / unit : 0;
  for (uint32_t k = 0; k < count; ++k) {
    const pal_real value = weights[k] * per_unit;
    integers[k] = static_cast<int16_t>(value + (value < 0 ? pal_real(-0.5) : pal_real(0.5)));
  }
  return unit / pack::kBasisUnit;
}

// z_k = sum over terms m_j C_jk of so many k: sums that stay in registers.
template <uint32_t kCount>
void add_terms(const pal_real* monomials, uint32_t terms, const pal_real* coefficients, uint32_t rank,
               pal_real* z) {
  pal_real sums[kCount] = {};
  for (uint32_t j = 0; j < terms; ++j, coefficients += rank) {
    for (uint32_t k = 0; k < kCount; ++k) sums[k] += monomials[j] * coefficients[k];
  }
  for (uint32_t k = 0; k < kCount; ++k) z[k] = sums[k];
}

}  // namespace

void weigh_polynomial(const pal_pack& pack, const PolynomialFieldState& state, PolynomialWeights& weights) {
  const pack::PolynomialSite& site = pack.polynomial_sites[state.site];
  weights.field = pack.polynomial_field + site.field_start;
  weights.panel_bytes = pack::polynomial_panel_bytes(site.rank, pack.basis_rounded);
  weights.num_columns = 3 + site.rank;

  pal_real monomials[kMostMonomials];
  const pal_real* at = state.x;
  pack::evaluate_monomials(at, site.degree, monomials);
  const double x[3] = {at[0], at[1], at[2]};
  const double s = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  const double metres = pack.metres * static_cast<double>(state.weight);
  for (uint32_t axis = 0; axis < 3; ++axis) weights.columns[axis] = static_cast<pal_real>(metres * x[axis]);
  double power = s > 1.0 ? 1.0 / s : 1.0;  // s^-n beyond the ball
  for (uint32_t degree = 2; degree <= site.degree; ++degree) {
    if (s > 1.0) power /= s;
    const auto scale = static_cast<pal_real>(metres * static_cast<double>(state.fade) *
                                             (s > 1.0 ? (1.0 + degree * (s - 1.0)) * power : 1.0));
    pal_real* monomial = monomials + pack::monomial_start(degree);
    for (uint32_t j = 0; j < pack::num_monomials(degree); ++j) monomial[j] *= scale;
  }
  pal_real* z = weights.columns + 3;
  const uint32_t terms = pack::num_monomials(2, site.degree);
  const pal_real* coefficients = pack.coefficients + site.coefficients_start;
  uint32_t k = 0;
  for (; k + kTogether <= site.rank; k += kTogether)
    add_terms<kTogether>(monomials + pack::monomial_start(2), terms, coefficients + k, site.rank, z + k);
  for (; k < site.rank; ++k)
    add_terms<1>(monomials + pack::monomial_start(2), terms, coefficients + k, site.rank, z + k);
  weights.rounded.num_pairs = 0;
  if (!pack.basis_rounded) return;
  RoundedWeights& rounded = weights.rounded;
  rounded.num_pairs = pack::num_column_pairs(site.rank);
  rounded.linear_unit =
      static_cast<pal_real>(site.linear_unit) * round_weights(weights.columns, 3, rounded.weights);
  rounded.unit = round_weights(z, site.rank, rounded.weights + 2 * pack::kLinearPairs);
}

void fill_polynomial_field(const PolynomialWeights& weights, uint32_t first, uint32_t count,
                           const FieldKernel& kernel, bool onto, pal_real* sum) {
  const unsigned char* panel = weights.field + first * weights.panel_bytes;
  for (uint32_t i = 0; i < count; ++i, panel += weights.panel_bytes, sum += pack::kPanelRows) {
    if (weights.rounded.num_pairs == 0) {
      kernel.add_columns(reinterpret_cast<const pal_real*>(panel), pack::kPanelRows, weights.columns,
                         weights.num_columns, onto, sum);
    } else {
      kernel.add_rounded(reinterpret_cast<const int16_t*>(panel), weights.rounded, onto, sum);
    }
  }
}

}  // namespace palpate
