#include "offline/pipeline/held_out_pushes.hpp"

#include <Eigen/LU>
#include <random>

namespace palpate {

Eigen::Matrix3d sampled_domain(const OpenedPack& opened, const Scene& scene, const ContactSites& sites,
                               size_t site) {
  const pack::PolynomialDd* polynomial = opened.tables().polynomial_dd();
  if (polynomial != nullptr) {
    const double* to_unit = opened.segment<pack::PolynomialSite>(*polynomial->sites())[site].to_unit;
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(to_unit).inverse();
  }
  return scene.max_displacement * sites.sites[site].frame;
}

std::vector<Push> draw_pushes(const OpenedPack& opened, const Scene& scene, const ContactSites& sites,
                              int count, std::int64_t seed) {
  const bool half = scene.directions == Directions::inward;
  std::mt19937_64 random(static_cast<std::uint64_t>(seed));
  // A builder seeds the survey of a site with the label. The highest bit excludes all labels.
  const std::vector<Eigen::Vector3d> points =
      choose_survey_points(count, half, random() | std::uint64_t{1} << 63);
  std::vector<Push> pushes;
  for (const Eigen::Vector3d& point : points) {
    const size_t site = random() % sites.sites.size();
    pushes.push_back(
        {site, sampled_domain(opened, scene, sites, site) * point, survey_increments(point.norm())});
  }
  return pushes;
}

}  // namespace palpate
