#include "runtime/src/polynomial/polynomial_field.hpp"

#include <math.h>

#include "runtime/src/pack/pack_view.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

constexpr uint32_t kMostMonomials = pack::num_monomials(0, pack::kMaxDegree);
constexpr uint32_t kTogether = 8;  // sums that stay in registers

// z_k = sum over j of m_j C_jk, for kCount values of k.
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

void combine_polynomial_basis(const pal_pack& pack, const PolynomialFieldState& state,
                              BasisCombination& columns) {
  const pack::PolynomialSite& site = pack.polynomial_sites[state.site];
  columns.field = pack.polynomial_field + site.field_start;
  columns.is_rounded = pack.basis_rounded;
  columns.num_columns = columns.num_weighted = 3 + site.rank;

  pal_real monomials[kMostMonomials];
  pack::evaluate_monomials(state.x, site.degree, monomials);
  const double x[3] = {static_cast<double>(state.x[0]), static_cast<double>(state.x[1]),
                       static_cast<double>(state.x[2])};
  const double s = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  const double metres = pack.metres * static_cast<double>(state.weight);
  for (uint32_t axis = 0; axis < 3; ++axis) columns.weights[axis] = static_cast<pal_real>(metres * x[axis]);
  double power = s > 1.0 ? 1.0 / s : 1.0;  // s^-n outside the ball
  for (uint32_t degree = 2; degree <= site.degree; ++degree) {
    if (s > 1.0) power /= s;
    const auto scale = static_cast<pal_real>(metres * static_cast<double>(state.fade) *
                                             (s > 1.0 ? (1.0 + degree * (s - 1.0)) * power : 1.0));
    pal_real* monomial = monomials + pack::monomial_start(degree);
    for (uint32_t j = 0; j < pack::num_monomials(degree); ++j) monomial[j] *= scale;
  }
  pal_real* z = columns.weights + 3;
  const uint32_t terms = pack::num_monomials(2, site.degree);
  const pal_real* coefficients = pack.coefficients + site.coefficients_start;
  uint32_t k = 0;
  for (; k + kTogether <= site.rank; k += kTogether)
    add_terms<kTogether>(monomials + pack::monomial_start(2), terms, coefficients + k, site.rank, z + k);
  for (; k < site.rank; ++k)
    add_terms<1>(monomials + pack::monomial_start(2), terms, coefficients + k, site.rank, z + k);
  if (!columns.is_rounded) return;
  round_weights(columns);
  columns.rounded.first_unit *= static_cast<pal_real>(site.linear_unit);
}

}  // namespace palpate
