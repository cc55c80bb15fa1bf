// Error estimates of answers, from the bounds of the pack's surveys.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/pack/contact_place.hpp"
#include "runtime/src/response/tissue_state.hpp"

namespace palpate {

// The error estimate without a survey: the whole answer may be wrong.
inline constexpr double kUnknownError = 1.0;

// The largest |component|.
double largest_component(const double d[3]);

// |d|, without overflow or underflow of the squares.
double length(const double d[3]);

// Whether the samples at every corner of a place cover this displacement.
bool is_sampled_about(const pal_pack& pack, const ContactPlace& place, const double displacement[3]);

// Sets bounds of 95 % of errors at this |d|, with 95 % confidence, from the survey bin. Sets kUnknownError
// outside the survey, or for any flag but PAL_FLAG_UNREFINED. `force`: |f|, model units.
void estimate_errors(const pal_pack& pack, pal_model model, bool surveyed, const double displacement[3],
                     double force, pal_contact_result& result);

// Raises the estimates to the largest estimate of the models that answer one contact at the corners.
void worsen_estimate(const pal_pack& pack, const ContactPlace& place, bool surveyed,
                     const double displacement[3], double force, pal_contact_result& result);

// Error estimates of several zone contacts, relative to their largest displacement and force. The bound is
// the maximum of:
// - the survey's bound for sets by load and by reach (ErrorSurvey in schemas/pack.fbs),
// - the bound for one contact of the largest displacement.
//
// A flag of one contact counts for all contacts, as does an estimate of kUnknownError.
void estimate_set_errors(const TissueState& tissue, bool surveyed, uint32_t count, double load,
                         pal_contact_result* results);

// Replaces the estimates e of refined zone contacts at sites by
//   rounding + 2 |change by the last iteration| / |d| + e |motion since the last iteration| / |d|.
void estimate_refined_errors(const TissueState& tissue, uint32_t count, pal_contact_result* results);

}  // namespace palpate
