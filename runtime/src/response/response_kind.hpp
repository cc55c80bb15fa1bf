// What answers a set of contacts.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

enum class ResponseKind : uint32_t {
  nothing,       // there are none: the tissue is at rest
  polynomial,    // polynomial_dd or affine_site, of one contact
  linear_point,  // linear_dd of one contact between sites (linear_point.hpp)
  zone,          // nonlinear_zone, once it is ready for them (nonlinear_zone.hpp)
  linear,        // linear_dd of any contacts, once it is ready for them (linear_dd.hpp)
};

// Whether a session of this model has what was made for the organ as it was built, and nothing else.
inline bool is_nonlinear_alone(pal_model model) {
  return model != PAL_MODEL_AUTO && model != PAL_MODEL_LINEAR;
}

inline pal_model model_of(ResponseKind kind) {
  switch (kind) {
    case ResponseKind::nothing:
      return PAL_MODEL_AUTO;
    case ResponseKind::polynomial:
      return PAL_MODEL_POLYNOMIAL;
    case ResponseKind::zone:
      return PAL_MODEL_ZONE;
    case ResponseKind::linear_point:
    case ResponseKind::linear:
      return PAL_MODEL_LINEAR;
  }
  return PAL_MODEL_AUTO;
}

}  // namespace palpate
