#include "offline/study/error_map.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "offline/output/value_maps.hpp"

namespace palpate {
namespace {

// Returns inward + kAside aside: `aside` points across `inward`, from the sites towards the organ's centre.
Eigen::Vector3d view_onto_sites(const Organ& organ) {
  constexpr double kAside = 0.7;
  constexpr double kOnTop = 0.05;  // fraction of the organ's size; a smaller offset gives no direction
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& position : organ.model.positions) box.extend(position);
  Eigen::Vector3d inward = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_position = Eigen::Vector3d::Zero();
  for (const ContactSite& site : organ.sites.sites) {
    inward += site.inward;
    mean_position +=
        organ.model.positions[static_cast<size_t>(site.node)] / static_cast<double>(organ.sites.sites.size());
  }
  if (inward.norm() == 0) return inward;
  inward.normalize();
  Eigen::Vector3d aside = box.center() - mean_position;
  aside -= aside.dot(inward) * inward;
  if (aside.norm() < kOnTop * box.diagonal().norm()) aside = inward.unitOrthogonal();
  return inward + kAside * aside.normalized();
}

}  // namespace

bool draw_error_map(const OpenedPack& opened, const Organ& organ, std::vector<NodeErrors> models,
                    const std::filesystem::path& png) {
  const pal_geometry geometry = opened.pack().geometry();
  std::erase_if(models, [](const NodeErrors& one) { return one.largest.empty(); });
  if (geometry.num_triangles == 0 || models.empty()) return false;
  const auto worst = [](const NodeErrors& one) {
    return *std::max_element(one.largest.begin(), one.largest.end());
  };
  std::sort(models.begin(), models.end(),
            [&](const NodeErrors& a, const NodeErrors& b) { return worst(a) > worst(b); });
  if (models.size() > 2) models.erase(models.begin() + 1, models.end() - 1);
  ValueMapPicture picture;
  for (std::uint32_t i = 0; i < geometry.num_nodes; ++i)
    picture.points.emplace_back(geometry.positions + size_t{3} * i);
  for (std::uint32_t i = 0; i < geometry.num_triangles; ++i) {
    const std::uint32_t* corners = geometry.triangles + size_t{3} * i;
    picture.triangles.push_back(
        {static_cast<int>(corners[0]), static_cast<int>(corners[1]), static_cast<int>(corners[2])});
  }
  picture.towards = view_onto_sites(organ);
  for (NodeErrors& model : models) {
    for (double& error : model.largest) error *= 100;
    picture.maps.push_back({std::move(model.model), std::move(model.largest)});
  }
  picture.bar_label = "% of |d|";
  write_value_maps(picture, png);
  return true;
}

}  // namespace palpate
