// Makes packs of polynomials transferred from other sites. Packs of scenes never carry such polynomials.
#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

#include "offline/output/progress_bar.hpp"
#include "offline/pipeline/build_plan.hpp"
#include "offline/pipeline/scene_sites.hpp"
#include "offline/precompute/affine_site.hpp"
#include "offline/study/study_packs.hpp"

namespace palpate {
namespace {

constexpr double kEdgesAside = 0.5;  // tolerance of a site's distance

struct Way {
  SiteMap map;
  bool linear_stays;  // transfers the nonlinear part only
  const char* name;
};
constexpr Way kWays[] = {{SiteMap::printed, false, "eq. (25) as printed"},
                         {SiteMap::inverse, false, "eq. (25) inverse"},
                         {SiteMap::affine, false, "affine about the site"},
                         {SiteMap::rigid, false, "rigid"},
                         {SiteMap::rigid, true, "exact linear part, remainder rigid"}};

const Eigen::Vector3d& place_of(const Organ& organ, const ContactSite& site) {
  return organ.model.positions[static_cast<size_t>(site.node)];
}

// Returns the site whose distance from `site` is nearest to `edges` edges. Returns the number of sites where
// no distance lies within kEdgesAside.
size_t site_away(const Organ& organ, const ContactSite& site, double edges) {
  size_t found = organ.sites.sites.size();
  double nearest = kEdgesAside;
  for (size_t other = 0; other < organ.sites.sites.size(); ++other) {
    if (organ.sites.sites[other].node == site.node) continue;
    const double away = (place_of(organ, organ.sites.sites[other]) - place_of(organ, site)).norm() /
                        organ.sites.mean_surface_edge;
    if (std::abs(away - edges) >= nearest) continue;
    nearest = std::abs(away - edges);
    found = other;
  }
  return found;
}

// Adds the exact linear response that moved_remainder() leaves out. With x = A d: u = F A^-1 x, and the
// energy d . S d / 2 in the monomials xx, xy, xz, yy, yz, zz.
void put_linear_part(const SiteLinearResponse& linear, SitePolynomial& polynomial) {
  const Eigen::Matrix3d from_unit = polynomial.to_unit.inverse();
  polynomial.linear = linear.field * from_unit;
  const Eigen::Matrix3d S = from_unit.transpose() * linear.stiffness * from_unit;
  polynomial.energy.head<6>() << S(0, 0) / 2, S(0, 1), S(0, 2), S(1, 1) / 2, S(1, 2), S(2, 2) / 2;
}

// Scales a rotated basis back to entries within 1, the range of a pack.
void normalise_basis(SitePolynomial& polynomial) {
  for (Eigen::Index column = 0; column < polynomial.basis.cols(); ++column) {
    const double size = polynomial.basis.col(column).lpNorm<Eigen::Infinity>();
    if (size <= 1) continue;
    polynomial.basis.col(column) /= size;
    polynomial.coefficients.col(column) *= size;
  }
}

}  // namespace

std::vector<std::unique_ptr<StudyPack>> make_transferred_packs(const Organ& organ, const Organ& study,
                                                               int jobs, const SampleStore* store,
                                                               std::vector<std::string>& notes) {
  // Source site of each contact's polynomial, by distance.
  std::map<int, std::vector<size_t>> sources;
  std::vector<size_t> sampled_sites;
  for (const int edges : {1, 2}) {
    std::vector<size_t> found;
    for (const ContactSite& contact : study.sites.sites) found.push_back(site_away(organ, contact, edges));
    if (std::count(found.begin(), found.end(), organ.sites.sites.size()) > 0) {
      notes.push_back(fmt::format(
          "Polynomials moved from {} edge{} away are not compared: some of the compared sites have no "
          "other one there.",
          edges, edges == 1 ? "" : "s"));
      continue;
    }
    sampled_sites.insert(sampled_sites.end(), found.begin(), found.end());
    sources[edges] = std::move(found);
  }
  if (sources.empty()) return {};
  std::sort(sampled_sites.begin(), sampled_sites.end());
  sampled_sites.erase(std::unique(sampled_sites.begin(), sampled_sites.end()), sampled_sites.end());

  LoadedScene loaded = with_sites(organ, sampled_sites);
  loaded.scene.linear = loaded.scene.polynomial = true;
  loaded.scene.zone = false;
  loaded.scene.compliance = ComplianceForm::dense;
  loaded.scene.polynomial_method = PolynomialMethod::hermite;
  loaded.scene.max_contacts = 1;
  const Organ sampled(std::move(loaded));
  SamplingPlan plan = plan_sampling(sampled.scene, sampled.sites, jobs);
  plan.survey_samples = 0;
  plan.rounded = false;
  plan.fewest = false;  // transfer needs a fit at each source site
  std::vector<SiteResult> results;
  try {
    const LinearDd linear = compute_linear_dd(sampled.assembly, sampled.sites, {}, sampled.rest);
    ProgressBar bar("sites around", static_cast<int>(sampled.sites.sites.size()));
    results = sample_sites(
        sampled.assembly, sampled.scene, sampled.sites, linear, plan, [&](int done, int) { bar.show(done); },
        sampled.rest, store);
  } catch (const std::runtime_error& error) {
    notes.push_back(std::string("Moved polynomials are not compared. ") + error.what());
    return {};
  }
  const auto polynomial_at = [&](size_t site) -> const SitePolynomial& {
    for (size_t i = 0; i < results.size(); ++i) {
      if (sampled.sites.sites[i].node == organ.sites.sites[site].node) return results[i].polynomial;
    }
    throw std::logic_error("a site that was to be sampled was not");
  };

  const LinearDd linear = compute_linear_dd(study.assembly, study.sites, {}, study.rest);
  std::vector<std::unique_ptr<StudyPack>> packs;
  for (const auto& [edges, from] : sources) {
    for (const Way& way : kWays) {
      std::vector<SiteResult> transferred_results(study.sites.sites.size());
      bool is_singular = false;
      for (size_t i = 0; i < transferred_results.size(); ++i) {
        const ContactSite& contact = study.sites.sites[i];
        const auto placement =
            place_contact(organ.model, organ.sites, way.map, organ.sites.sites[from[i]], contact);
        if (!placement) {
          is_singular = true;
          break;
        }
        const LocalTable table = local_table(organ.model, organ.sites, *placement);
        SitePolynomial& polynomial = transferred_results[i].polynomial;
        polynomial = way.linear_stays ? moved_remainder(polynomial_at(from[i]), *placement, table)
                                      : moved(polynomial_at(from[i]), *placement, table);
        normalise_basis(polynomial);
        if (way.linear_stays) put_linear_part(linear_response(linear, contact), polynomial);
      }
      const std::string setting = fmt::format("{}, from {} edge{}", way.name, edges, edges == 1 ? "" : "s");
      if (is_singular) {
        notes.push_back("The moved polynomial, " + setting +
                        ", is not compared: at one of the sites its map is singular.");
        continue;
      }
      Scene scene = sampled.scene;
      scene.sites = study.scene.sites;
      PackContent content{study.model, scene, study.sites, nullptr, &transferred_results, false, {}, {}};
      content.rest = &study.rest;
      packs.push_back(std::make_unique<StudyPack>(setting, write_pack(content)));
    }
  }
  return packs;
}

}  // namespace palpate
