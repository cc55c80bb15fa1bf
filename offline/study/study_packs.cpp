#include "offline/study/study_packs.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "offline/output/progress_bar.hpp"
#include "offline/pipeline/build_plan.hpp"
#include "offline/pipeline/pack_build.hpp"
#include "offline/precompute/nonlinear_zone.hpp"

namespace palpate {
namespace {

// Returns a scene with these models only; its loose target accepts every error.
Scene study_scene(const Organ& organ) {
  Scene scene = organ.scene;
  scene.linear = true;
  scene.compliance = ComplianceForm::dense;
  scene.polynomial = false;
  scene.zone = false;
  scene.polynomial_method = PolynomialMethod::hermite;
  scene.max_contacts = 1;
  return scene;
}

Scene zone_scene(const Organ& organ) {
  Scene scene = study_scene(organ);
  scene.zone = true;
  scene.max_contacts = 1;
  return scene;
}

const char* precision_name(pack::FieldPrecision precision) {
  if (precision == pack::FieldPrecision::i16) return "int16";
  return sizeof(pack::Real) == sizeof(float) ? "float32" : "float64";
}

}  // namespace

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

std::vector<std::unique_ptr<StudyPack>> make_polynomial_packs(const Organ& organ, int jobs,
                                                              std::vector<PolynomialSetting> settings,
                                                              const SampleStore* store) {
  constexpr size_t kLeastSamples = 16;
  const Scene scene = study_scene(organ);
  const LinearDd linear = compute_linear_dd(organ.assembly, organ.sites, {}, organ.rest);
  SamplingPlan plan;
  plan.target = scene.accuracy_target;
  plan.least_samples = kLeastSamples;
  plan.survey_samples = 0;
  plan.jobs = jobs;
  plan.other_settings = std::move(settings);
  Scene sampled = scene;
  sampled.polynomial = true;
  std::vector<SiteResult> results;
  {
    ProgressBar bar("other polynomials", static_cast<int>(organ.sites.sites.size()));
    results = sample_sites(
        organ.assembly, sampled, organ.sites, linear, plan, [&](int done, int) { bar.show(done); },
        organ.rest, store);
  }
  std::vector<std::unique_ptr<StudyPack>> packs;
  for (size_t i = 0; i < plan.other_settings.size(); ++i) {
    for (SiteResult& result : results) result.polynomial = std::move(result.others[i]);
    PackContent content{organ.model, sampled, organ.sites, nullptr, &results, plan.other_settings[i].rounded,
                        {},          {}};
    content.rest = &organ.rest;
    auto pack = std::make_unique<StudyPack>("", write_pack(content));
    pack->setting = polynomial_setting(pack->opened);
    packs.push_back(std::move(pack));
  }
  return packs;
}

std::unique_ptr<StudyPack> make_zone_pack(const Organ& organ, int rings) {
  Scene scene = zone_scene(organ);
  scene.zone_rings = rings;
  const LinearDd linear = compute_linear_dd(organ.assembly, organ.sites, {}, organ.rest);
  const ZoneTables zone = find_zones(organ.model, organ.sites, scene.zone_rings);
  PackContent content{organ.model, scene, organ.sites, &linear, nullptr, false, {}, {}};
  content.rest = &organ.rest;
  content.zone = &zone;
  return std::make_unique<StudyPack>(fmt::format("{} rings", scene.zone_rings), write_pack(content));
}

}  // namespace palpate
