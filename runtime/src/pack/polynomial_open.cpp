#include "runtime/src/pack/polynomial_open.hpp"

#include <math.h>

#include "runtime/src/pack/number_checks.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

// The consecutive parts of all sites in one array.
struct Stretch {
  uint64_t length;
  // Appends the next site's part. False if the part does not follow the last part.
  bool append(uint64_t start, uint64_t count) {
    if (start != length) return false;
    length += count;
    return true;
  }
};

// Whether A maps an ellipsoid to the unit ball. Its semi-axes lie between a quarter of max_displacement and
// max_displacement.
bool is_map(const double A[9], double max_displacement) {
  constexpr double kMostStretch = 4.0;
  constexpr double kRounding = 1e-9;
  double scaled[9];
  for (int i = 0; i < 9; ++i) {
    scaled[i] = A[i] * max_displacement;
    if (!(fabs(scaled[i]) <= kMostStretch + kRounding)) return false;
  }
  const double* a = scaled;
  const double determinant = a[0] * (a[4] * a[8] - a[5] * a[7]) - a[1] * (a[3] * a[8] - a[5] * a[6]) +
                             a[2] * (a[3] * a[7] - a[4] * a[6]);
  return fabs(determinant) >= 1.0 - kRounding;
}

bool is_site(const pack::PolynomialSite& site, const pal_pack& pack) {
  return site.degree >= 1 && site.degree <= pack.degree && site.rank <= pack::kMostRank &&
         isfinite(site.min_jacobian) && site.basis_error >= 0 && isfinite(site.basis_error) &&
         is_map(site.to_unit, pack.max_displacement) &&
         (!pack.basis_rounded ||
          (site.linear_unit >= 0 &&
           static_cast<double>(site.linear_unit) <= kLargestAmplification * pack.max_displacement));
}

}  // namespace

bool read_polynomial(const pack::PolynomialDd& polynomial, uint64_t first_offset, bool trusted,
                     pal_pack& pack) {
  pack.degree = polynomial.degree();
  pack.basis_rounded = polynomial.precision() == pack::FieldPrecision::i16;
  if (pack.degree < 1 || pack.degree > pack::kMaxDegree ||
      (!pack.basis_rounded && polynomial.precision() != pack::FieldPrecision::real)) {
    return false;
  }
  pack.polynomial_sites =
      array_of<pack::PolynomialSite>(pack, polynomial.sites(), first_offset, pack.num_sites);
  if (pack.polynomial_sites == nullptr) return false;
  const uint64_t panels = pack::num_panels(pack.num_nodes);
  Stretch energy = {};
  Stretch coefficients = {};
  Stretch field = {};
  for (uint32_t i = 0; i < pack.num_sites; ++i) {
    const pack::PolynomialSite& site = pack.polynomial_sites[i];
    if (!is_site(site, pack) || !energy.append(site.energy_start, pack::num_monomials(2, site.degree + 1)) ||
        !coefficients.append(site.coefficients_start,
                             uint64_t{pack::num_monomials(2, site.degree)} * site.rank) ||
        !field.append(site.field_start,
                      panels * pack::field_panel_bytes(3 + site.rank, pack.basis_rounded))) {
      return false;
    }
  }
  pack.energy = array_of<double>(pack, polynomial.energy(), first_offset, energy.length);
  pack.coefficients = array_of<pal_real>(pack, polynomial.coefficients(), first_offset, coefficients.length);
  pack.polynomial_field = array_of<unsigned char>(pack, polynomial.field(), first_offset, field.length);
  if (pack.energy == nullptr || pack.coefficients == nullptr || pack.polynomial_field == nullptr)
    return false;
  if (trusted) return true;

  const auto largest = static_cast<pal_real>(kLargestAmplification * pack.max_displacement);
  constexpr pal_real kLargestBasis = pal_real(1.001);  // 1, with rounding
  if (!all_within(pack.energy, energy.length, kLargestEnergy) ||
      !all_within(pack.coefficients, coefficients.length, largest)) {
    return false;
  }
  if (pack.basis_rounded) return true;  // int16 columns allow every integer
  for (uint32_t i = 0; i < pack.num_sites; ++i) {
    const pack::PolynomialSite& site = pack.polynomial_sites[i];
    const uint64_t panel_bytes = pack::field_panel_bytes(3 + site.rank, false);
    for (uint64_t panel = 0; panel < panels; ++panel) {
      const auto* columns =
          reinterpret_cast<const pal_real*>(pack.polynomial_field + site.field_start + panel * panel_bytes);
      if (!all_within(columns, size_t{3} * pack::kPanelRows, largest) ||
          !all_within(columns + size_t{3} * pack::kPanelRows, size_t{site.rank} * pack::kPanelRows,
                      kLargestBasis)) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace palpate
