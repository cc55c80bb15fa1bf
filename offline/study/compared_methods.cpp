#include "offline/study/compared_methods.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>

#include "offline/mesh/volume_patches.hpp"
#include "offline/pipeline/scene_sites.hpp"

namespace palpate {
namespace {

std::string zone_name(std::uint32_t rings) {
  return fmt::format("nonlinear_zone, {} ring{}", rings, rings == 1 ? "" : "s");
}

// Combines degrees 2 to 7 with two ranks and both precisions, and varies the rank of the usual degree.
// Without `every` returns a few of these settings. Degree 1 is linear_dd and is left out.
std::vector<PolynomialSetting> polynomial_settings(const Scene& scene, bool every) {
  constexpr int kUsualDegree = 5;
  constexpr double kAllOfIt = 1e-6;
  const double usual = kBasisPart * scene.accuracy_target;
  if (!every) return {{2, usual, true}, {3, usual, true}, {kUsualDegree, usual, true}, {7, kAllOfIt, false}};
  std::vector<PolynomialSetting> settings;
  for (int degree = 2; degree <= 7; ++degree) {
    for (const double tolerance : {usual, kAllOfIt}) {
      for (const bool rounded : {true, false}) settings.push_back({degree, tolerance, rounded});
    }
  }
  for (const double tolerance : {3e-2, 1e-2, 5e-4, 1e-4}) settings.push_back({kUsualDegree, tolerance, true});
  return settings;
}

}  // namespace

std::vector<ComparedMethod> carried_methods(const OpenedPack& opened) {
  std::vector<ComparedMethod> methods;
  const pal_pack_info info = opened.info();
  if (info.has_linear != 0)
    methods.push_back({{MethodKind::linear, "linear_dd", true}, &opened, PAL_MODEL_LINEAR});
  if (info.has_polynomial != 0) {
    methods.push_back({{MethodKind::polynomial, "polynomial_dd, " + polynomial_setting(opened), true},
                       &opened,
                       PAL_MODEL_POLYNOMIAL});
  }
  for (std::uint32_t rings = 1; rings <= info.zone_rings; ++rings)
    methods.push_back({{MethodKind::zone, zone_name(rings), true}, &opened, PAL_MODEL_ZONE, rings});
  return methods;
}

std::vector<ComparedMethod> moving_zones(const std::vector<ComparedMethod>& methods, int most_rings,
                                         const std::vector<int>& iterations) {
  std::vector<ComparedMethod> moving;
  for (const ComparedMethod& method : methods) {
    if (method.kind != MethodKind::zone || static_cast<int>(method.rings) > most_rings) continue;
    for (const int count : iterations) {
      ComparedMethod& one = moving.emplace_back(method);
      one.name += fmt::format(", {} iteration{} a frame", count, count == 1 ? "" : "s");
      one.carried = false;
      one.iterations = static_cast<std::uint32_t>(count);
    }
  }
  return moving;
}

OtherSettings::OtherSettings(const OpenedPack& opened, const Organ& organ, const std::vector<size_t>& sites,
                             const ReportEffort& effort, int jobs, const SampleStore* store,
                             std::vector<std::string>& notes) {
  const Organ study(with_sites(organ, sites));
  in_study_.resize(organ.sites.sites.size());
  for (size_t i = 0; i < study.sites.sites.size(); ++i) {
    for (const size_t site : sites) {
      if (organ.sites.sites[site].node == study.sites.sites[i].node)
        in_study_[site] = static_cast<std::uint32_t>(i);
    }
  }
  try {
    packs_ =
        make_polynomial_packs(study, jobs, polynomial_settings(study.scene, effort.every_setting), store);
  } catch (const std::runtime_error& error) {
    notes.push_back(std::string("Other polynomials are not compared. ") + error.what());
  }
  for (const auto& pack : packs_) {
    const std::string name = "polynomial_dd, " + pack->setting;
    const auto is_there = [&](const ComparedMethod& method) { return method.name == name; };
    if (std::any_of(methods_.begin(), methods_.end(), is_there))
      continue;  // this tolerance gives a rank that is already present
    methods_.push_back({{MethodKind::polynomial, name, false}, &pack->opened, PAL_MODEL_POLYNOMIAL});
  }
  for (auto& pack : make_transferred_packs(organ, study, jobs, store, notes)) {
    methods_.push_back({{MethodKind::moved, "moved polynomial, " + pack->setting, false},
                        &pack->opened,
                        PAL_MODEL_POLYNOMIAL});
    packs_.push_back(std::move(pack));
  }
  const auto carried = opened.info().zone_rings;
  if (static_cast<int>(carried) >= effort.most_zone_rings) return;
  if (shares_linear_volumes(study.model)) {
    notes.push_back(
        "Other zones are not compared: a nonlinear zone cannot hold elements that share their volume where "
        "the material is *ELASTIC at small strain.");
    return;
  }
  auto zone = make_zone_pack(study, effort.most_zone_rings);
  for (std::uint32_t rings = carried + 1; rings <= zone->opened.info().zone_rings; ++rings) {
    methods_.push_back({{MethodKind::zone, zone_name(rings), false}, &zone->opened, PAL_MODEL_ZONE, rings});
  }
  packs_.push_back(std::move(zone));
}

}  // namespace palpate
