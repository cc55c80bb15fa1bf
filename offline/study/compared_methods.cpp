#include "offline/study/compared_methods.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string>

namespace palpate {
namespace {

const char* precision_name(pack::FieldPrecision precision) {
  if (precision == pack::FieldPrecision::i16) return "int16";
  return sizeof(pack::Real) == sizeof(float) ? "float32" : "float64";
}

// Returns "degree 5, rank 20, int16", with the largest values of any site. The pack must carry polynomial_dd.
std::string polynomial_setting(const OpenedPack& opened) {
  const pack::PolynomialDd& polynomial = *opened.tables().polynomial_dd();
  std::uint32_t degree = 0;
  std::uint32_t rank = 0;
  for (const pack::PolynomialSite& site : opened.segment<pack::PolynomialSite>(*polynomial.sites())) {
    degree = std::max(degree, site.degree);
    rank = std::max(rank, site.rank);
  }
  return fmt::format("degree {}, rank {}, {}", degree, rank, precision_name(polynomial.precision()));
}

}  // namespace

std::vector<ComparedMethod> carried_methods(const OpenedPack& opened) {
  std::vector<ComparedMethod> methods;
  const pal_pack_info info = opened.info();
  if (info.has_linear != 0) methods.push_back({{MethodKind::linear, "linear_dd"}, PAL_MODEL_LINEAR});
  if (info.has_polynomial != 0) {
    methods.push_back(
        {{MethodKind::polynomial, "polynomial_dd, " + polynomial_setting(opened)}, PAL_MODEL_POLYNOMIAL});
  }
  for (std::uint32_t rings = 1; rings <= info.zone_rings; ++rings) {
    methods.push_back(
        {{MethodKind::zone, fmt::format("nonlinear_zone, {} ring{}", rings, rings == 1 ? "" : "s")},
         PAL_MODEL_ZONE,
         rings});
  }
  return methods;
}

}  // namespace palpate
