// polynomial_dd (PIAM): energy and displacement field of one contact site as polynomials in the tool displacement.
//
// Source: Zhong et al. 2005 eqs. (22)-(24), with two departures. The force is not recomputed from the elements around
// the contact (eq. (4) amplifies the error of fitted displacements) but is the gradient of a fitted energy:
// conservative by construction, so that a device cannot be fed energy around a closed path. And the linear part is
// not fitted but the exact linear DD.
//
// With x = A d, which maps the ellipsoid of displacements that was sampled to the unit ball, s = |x|, and U the sum
// of homogeneous parts E_n(x) of degree n, the answer inside is
//   energy  sum_n E_n(x)          field  sum_n u_n(x).
// Beyond it (s > 1) each part, s^n along a ray, is continued by its expansion at s = 1:
//   energy  s^n -> q_n(s) = 1 + n (s - 1) + n (n - 1)/2 (s - 1)^2      (C2: continuous stiffness)
//   field   s^n -> l_n(s) = 1 + n (s - 1)                              (C1)
// that is, E_n(x) is multiplied by q_n(s) / s^n and u_n(x) by l_n(s) / s^n. From s = 4 on field and stiffness are those
// there, and the energy goes on along the ray by the force there (C1: the force is still its gradient, but the
// stiffness not that of the force).
//
// Where only inward displacements were sampled (n the inward normal, c = d . n |A n|, 1 at the end of the domain
// along n), the nonlinear part fades out behind the surface: E_n and u_(n-1) with n > 2 are multiplied by phi(c), 1
// for c >= 0, 0 for c <= -1/2, a quintic between them (C2). Deep behind it the answer is the exact linear one.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

// Beyond this many radii the displacement is shortened.
inline constexpr double kLargestExtrapolation = 4.0;

// Whether the site's polynomial was fitted to nonlinear solves; else it is affine_site's.
inline bool was_sampled(const pal_pack& pack, uint32_t site) {
  return pack.polynomial_sites[site].samples > 0;
}

struct PolynomialAnswer {
  uint32_t flags;       // PAL_FLAG_EXTRAPOLATED, PAL_FLAG_CLAMPED
  double energy;        // model units
  double force[3];      // model units
  double stiffness[9];  // row-major
};

// Whether displacements as this one were sampled at the site; of a pack without polynomials, whether they are as
// long as the scene's at most.
bool is_sampled(const pal_pack& pack, uint32_t site, const double displacement[3]);

// What polynomial_field.hpp makes the field of.
struct PolynomialFieldState {
  uint32_t site;
  pal_real weight;  // of the site in a blend
  pal_real x[3];
  pal_real fade;  // phi
};

// Force and stiffness at a site of the pack for a finite displacement, model units, and the state of the field but for
// its weight.
// Cost at degree 3: 31 energy terms, about 200 multiply-adds; at degree 14 812 and 3,500.
void evaluate_polynomial(const pal_pack& pack, uint32_t site, const double displacement[3],
                         PolynomialAnswer& answer, PolynomialFieldState& field);

}  // namespace palpate
