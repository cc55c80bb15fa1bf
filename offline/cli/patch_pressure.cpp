#include "offline/cli/patch_pressure.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace palpate {

std::optional<double> patch_pressure(const OpenedPack& opened, std::uint32_t site, const double force[3]) {
  const pack::ContactSites& sites = *opened.tables().sites();
  const auto contact_nodes = opened.segment(*sites.contact_nodes());
  const auto members = opened.segment(*sites.patch_nodes());
  const auto starts = opened.segment(*sites.patch_starts());
  const pal_geometry geometry = opened.pack().geometry();
  std::vector<std::uint32_t> patch;
  for (std::uint32_t i = starts[site]; i < starts[site + 1]; ++i) patch.push_back(contact_nodes[members[i]]);
  double area = 0;
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();
  for (std::uint32_t i = 0; i < geometry.num_triangles; ++i) {
    const std::uint32_t* corners = geometry.triangles + 3 * i;
    const auto num_in_patch = std::count_if(corners, corners + 3, [&](std::uint32_t corner) {
      return std::find(patch.begin(), patch.end(), corner) != patch.end();
    });
    if (num_in_patch == 0) continue;
    const auto position = [&](int corner) {
      return Eigen::Map<const Eigen::Vector3d>(geometry.positions + size_t{3} * corners[corner]);
    };
    const Eigen::Vector3d triangle = 0.5 * (position(1) - position(0)).cross(position(2) - position(0));
    const double share = static_cast<double>(num_in_patch) / 3;
    area += share * triangle.norm();
    outward += share * triangle;
  }
  if (area == 0 || outward.isZero(0)) return std::nullopt;
  return -Eigen::Map<const Eigen::Vector3d>(force).dot(outward.normalized()) / area;
}

}  // namespace palpate
