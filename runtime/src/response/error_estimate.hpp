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

// The bound of 95 % of errors at this |d|, with 95 % confidence; interpolated with the slope of its survey
// bin. kUnknownError for a flagged answer, or a case outside the survey. The force error is relative to
// `force`, in model units.
void estimate_errors(const pal_pack& pack, pal_model model, bool surveyed, const double displacement[3],
                     double force, pal_contact_result& result);

// Raises the estimates to the largest estimate of the corners' own models.
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

// Replaces the estimates of refined zone contacts at sites. The organ is as far from equilibrium as its last iteration has
// changed it, and the survey's estimates hold for the way that contacts have gone since.
void estimate_refined_errors(const TissueState& tissue, uint32_t count, pal_contact_result* results);

}  // namespace palpate
