// The response models for a contact set.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

enum class ResponseKind : uint32_t {
  nothing,       // no contacts: the tissue is at rest
  polynomial,    // polynomial_dd or affine_site for one contact
  linear_point,  // linear_dd for one contact between sites (linear_point.hpp)
  zone,          // nonlinear_zone, after its preparation (nonlinear_zone.hpp)
  linear,        // linear_dd for any contacts, after its preparation (linear_dd.hpp)
};

// Whether the caller chose a nonlinear model. Then linear_dd answers only while a zone is in preparation.
inline bool is_nonlinear_only(pal_model model) {
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
