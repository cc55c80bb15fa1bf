#include "runtime/src/response/error_estimate.hpp"

#include <math.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/polynomial/polynomial_dd.hpp"

namespace palpate {
namespace {

// The model that answers one contact alone at a site.
pal_model model_alone(const pal_pack& pack, uint32_t site) {
  if (pack.polynomial_sites == nullptr) return PAL_MODEL_LINEAR;
  return was_sampled(pack, site) ? PAL_MODEL_POLYNOMIAL : PAL_MODEL_AFFINE;
}

// The survey of a model; for zones, the survey of answers without a correction by the refining lane.
const SurveyView& survey_of(const pal_pack& pack, pal_model model) {
  return pack
      .surveys[model == PAL_MODEL_ZONE ? kUnrefinedZone : static_cast<uint32_t>(model - PAL_MODEL_LINEAR)];
}

}  // namespace

double largest_component(const double d[3]) {
  const double x = fabs(d[0]);
  const double y = fabs(d[1]);
  const double z = fabs(d[2]);
  const double larger = x > y ? x : y;
  return larger > z ? larger : z;
}

double length(const double d[3]) {
  constexpr double kLeast = 1e-140;  // the square of a smaller component underflows
  constexpr double kMost = 1e140;
  const double largest = largest_component(d);
  if (largest > kLeast && largest < kMost) return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  if (largest == 0) return 0;
  const double x = d[0] / largest;
  const double y = d[1] / largest;
  const double z = d[2] / largest;
  return largest * sqrt(x * x + y * y + z * z);
}

bool is_sampled_about(const pal_pack& pack, const ContactPlace& place, const double displacement[3]) {
  for (uint32_t i = 0; i < place.count; ++i) {
    if (!is_in_domain(pack, place.corners[i].site, displacement)) return false;
  }
  return true;
}

void estimate_errors(const pal_pack& pack, pal_model model, bool surveyed, const double displacement[3],
                     double force, pal_contact_result& result) {
  result.displacement_error = kUnknownError;
  result.force_error = kUnknownError;
  if (!surveyed || (result.flags & ~uint32_t{PAL_FLAG_UNREFINED}) != 0) return;
  const SurveyView& survey = survey_of(pack, model);
  const double size = length(displacement) / pack.max_displacement;
  for (uint32_t bin = 0; bin < survey.num_bins; ++bin) {
    // The tolerance keeps the scene's largest displacement in the last bin.
    const ErrorBinView& view = survey.bins[bin];
    if (size <= view.to * (1.0 + 1e-9)) {
      const double below = std::max(0.0, view.to - size);
      result.displacement_error = std::max(0.0, view.displacement_bound - below * view.displacement_slope);
      // Below the scale, the error is at most bound * scale, so the exact force is at least `least`.
      const double bound = std::max(0.0, view.force_bound - below * view.force_slope);
      const double scale = static_cast<double>(survey.force_scale) * std::min(1.0, size);
      const double least = force - bound * scale;
      result.force_error = !(force < scale)        ? bound
                           : least > bound * scale ? bound * scale / least
                                                   : std::max(kUnknownError, bound);
      return;
    }
  }
}

void worsen_estimate(const pal_pack& pack, const ContactPlace& place, bool surveyed,
                     const double displacement[3], double force, pal_contact_result& result) {
  for (uint32_t i = 0; i < place.count; ++i) {
    pal_contact_result corner = {};
    corner.flags = result.flags;
    estimate_errors(pack, model_alone(pack, place.corners[i].site), surveyed, displacement, force, corner);
    result.displacement_error = std::max(result.displacement_error, corner.displacement_error);
    result.force_error = std::max(result.force_error, corner.force_error);
  }
}

void estimate_set_errors(const TissueState& tissue, bool surveyed, uint32_t count, double load,
                         pal_contact_result* results) {
  const pal_pack& pack = *tissue.pack;
  const SurveyView& survey = survey_of(pack, PAL_MODEL_ZONE);
  const double* largest = tissue.displacements;
  pal_contact_result set_result = {};
  double largest_size = 0;
  double reach = 0;
  for (uint32_t c = 0; c < count; ++c) {
    const double* d = tissue.displacements + size_t{3} * c;
    const double size = length(d) / pack.max_displacement;
    reach += size * size;
    if (!(size > largest_size)) continue;
    largest_size = size;
    largest = d;
  }
  const double displacement_error =
      std::max(survey.set_displacement_bound * load, survey.set_displacement_reach_bound * reach);
  const double force_error = std::max(survey.set_force_bound * load, survey.set_force_reach_bound * reach);
  const ZoneCorrection& correction = tissue.zone.active.correction;
  const bool is_refined = correction.is_refined && isfinite(correction.change);
  for (uint32_t c = 0; c < count; ++c) {
    if (displacement_error >= kUnknownError && !is_refined) results[c].flags |= PAL_FLAG_EXTRAPOLATED;
    set_result.flags |= results[c].flags;
  }
  estimate_errors(pack, PAL_MODEL_ZONE, surveyed && count <= survey.most_contacts, largest,
                  static_cast<double>(INFINITY), set_result);
  for (uint32_t c = 0; c < count; ++c) {
    results[c].displacement_error =
        std::min(kUnknownError, std::max(set_result.displacement_error, displacement_error));
    results[c].force_error = std::min(kUnknownError, std::max(set_result.force_error, force_error));
  }
}

void estimate_refined_errors(const TissueState& tissue, uint32_t count, pal_contact_result* results) {
  // An iteration that converges at least halves the error.
  constexpr double kErrorPerChange = 2;
  constexpr double kRounding = 2e-6;  // relative error of fields in single precision and of converged frames
  const pal_pack& pack = *tissue.pack;
  const ZoneSet& set = tissue.zone.active;
  double largest = 0;
  double moved = 0;
  for (uint32_t at = 0; at < set.num_axes; at += 3) {
    const double unit = at < 3 * count ? 1 : pack.mean_surface_edge;
    double change[3];
    for (uint32_t i = 0; i < 3; ++i) change[i] = set.followed[at + i] - set.correction.followed_then[at + i];
    largest = std::max(largest, unit * length(set.followed + at));
    moved = std::max(moved, unit * length(change));
  }
  if (!(largest > 0)) return;
  const double part = std::min(1.0, moved / largest);
  const double by_change = kRounding + kErrorPerChange * set.correction.change / largest;
  for (uint32_t c = 0; c < count; ++c) {
    pal_contact_result& result = results[c];
    const double force = length(result.force) / pack.newtons;
    const bool is_known = set.correction.force_change[c] >= 0 && force > 0;
    const double by_force =
        is_known ? kRounding + kErrorPerChange * set.correction.force_change[c] / force : by_change;
    result.displacement_error = std::min(kUnknownError, by_change + part * result.displacement_error);
    result.force_error = std::min(kUnknownError, by_force + part * result.force_error);
  }
}

}  // namespace palpate
