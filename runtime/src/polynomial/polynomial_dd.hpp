// Gives the energy and the displacement field of one contact site as polynomials in the tool displacement.
// The paper calls the method PIAM.
//
// Source: Zhong et al. 2005 eqs. (22)-(24), with two departures:
// - The force is the gradient of a fitted energy, so a closed path creates no energy. Eq. (4) instead recomputes the
//   force from the elements around the contact, and amplifies the error of fitted displacements.
// - The linear part is not a fit, but the exact answer of linear_dd (linear/linear_dd.hpp).
//
// x = A d maps the sampled ellipsoid of displacements to the unit ball, and s = |x|. E_n and u_n are
// homogeneous parts of degree n. Inside the ball
//   energy  sum_n E_n(x)          field  sum_n u_n(x).
// Outside (s > 1) the expansion of s^n at s = 1 replaces s^n along a ray:
//   energy  s^n -> q_n(s) = 1 + n (s - 1) + n (n - 1)/2 (s - 1)^2      (C2: continuous stiffness)
//   field   s^n -> l_n(s) = 1 + n (s - 1)                              (C1)
// So the factors are q_n(s) / s^n on E_n(x) and l_n(s) / s^n on u_n(x). Beyond s = 4, field and stiffness
// keep their values at s = 4, and the energy grows along the ray by the force there (C1). The force remains
// the gradient of the energy, but the stiffness is no longer the derivative of the force.
//
// In a pack with only inward samples, each site has an inward unit normal N, and c = d . N |A N|, which is 1
// at the end of the domain along N. For outward displacements (c < 0) the nonlinear part fades out: E_n and
// u_(n-1) with n > 2 have the factor phi(c), 1 for c >= 0, 0 for c <= -1/2, a quintic between (C2). Hence the
// answer for c <= -1/2 is linear up to s = 4.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

// |A d| beyond which the answer is that of a shorter displacement, extended along the ray.
inline constexpr double kLargestExtrapolation = 4.0;

// Whether nonlinear solves determined the site's polynomial. Otherwise the polynomial is the Taylor
// series at rest (offline/precompute/affine_site.hpp).
inline bool was_sampled(const pal_pack& pack, uint32_t site) {
  return pack.polynomial_sites[site].samples > 0;
}

struct PolynomialAnswer {
  uint32_t flags;       // PAL_FLAG_EXTRAPOLATED, PAL_FLAG_CLAMPED
  double energy;        // model units
  double force[3];      // model units
  double stiffness[9];  // row-major
};

// Whether the domain of the site contains the displacement: the ellipsoid |A d| <= 1, or in a pack without
// polynomials the ball of the scene's largest displacement. With inward normals, the domain is only the half
// where d . N >= 0.
bool is_in_domain(const pal_pack& pack, uint32_t site, const double displacement[3]);

// Holds the input of the displacement field (polynomial_field.hpp).
struct PolynomialFieldState {
  uint32_t site;
  pal_real weight;  // weight of the site in a blend
  pal_real x[3];    // A d, shortened to length kLargestExtrapolation
  pal_real fade;    // phi
};

// Computes energy, force and stiffness at a site for a finite displacement in model units, and fills `field`
// except for its weight.
void evaluate_polynomial(const pal_pack& pack, uint32_t site, const double displacement[3],
                         PolynomialAnswer& answer, PolynomialFieldState& field);

}  // namespace palpate
