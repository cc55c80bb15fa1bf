#include "offline/precompute/contact_sites.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>
#include <string>

namespace palpate {
namespace {

// Returns ContactSite::frame. A surface edge replaces a missing normal.
Eigen::Matrix3d frame_at(const Model& model, const Surface& surface, int node,
                         const Eigen::Vector3d& inward) {
  constexpr double kLeastAside = 0.1;  // least sine of the angle between an edge and the axis
  Eigen::Vector3d axis = inward;
  const auto begin = static_cast<size_t>(surface.neighbour_start[static_cast<size_t>(node)]);
  const auto end = static_cast<size_t>(surface.neighbour_start[static_cast<size_t>(node) + 1]);
  for (size_t i = begin; i < end; ++i) {
    const Eigen::Vector3d edge = (model.positions[static_cast<size_t>(surface.neighbours[i])] -
                                  model.positions[static_cast<size_t>(node)])
                                     .normalized();
    if (axis.isZero()) axis = edge;
    const Eigen::Vector3d aside = edge - edge.dot(axis) * axis;
    if (aside.norm() < kLeastAside) continue;
    Eigen::Matrix3d frame;
    frame << aside.normalized(), axis.cross(aside.normalized()), axis;
    return frame;
  }
  return Eigen::Matrix3d::Identity();
}

}  // namespace

ContactSites find_contact_sites(const Scene& scene, const Model& model) {
  const Surface surface = extract_surface(model);
  const std::vector<Eigen::Vector3d> normals = outward_normals(model, surface);
  const std::vector<char> fixed = model.fixed_nodes();

  ContactSites result;
  result.mean_surface_edge = surface.mean_edge;
  result.packed_nodes = scene.output_nodes;
  const auto by_label = [&](int a, int b) {
    return model.labels[static_cast<size_t>(a)] < model.labels[static_cast<size_t>(b)];
  };
  std::sort(result.packed_nodes.begin(), result.packed_nodes.end(), by_label);
  std::vector<int> packed_of(static_cast<size_t>(model.num_nodes()), -1);
  for (size_t i = 0; i < result.packed_nodes.size(); ++i) {
    packed_of[static_cast<size_t>(result.packed_nodes[i])] = static_cast<int>(i);
  }

  std::vector<int> site_nodes = scene.sites;
  std::sort(site_nodes.begin(), site_nodes.end(), by_label);
  std::vector<char> is_contact(result.packed_nodes.size(), 0);
  for (const int node : site_nodes) {
    ContactSite site;
    site.node = node;
    site.packed_node = packed_of[static_cast<size_t>(node)];
    site.inward = -normals[static_cast<size_t>(node)];
    if (scene.directions == Directions::inward && site.inward.isZero()) {
      throw std::runtime_error(scene.file.string() + ": the surface at node " +
                               std::to_string(model.labels[static_cast<size_t>(node)]) +
                               " has no inward direction; remove the site, or write directions = \"all\"");
    }
    site.frame = frame_at(model, surface, node, site.inward);
    const std::vector<int> within = nodes_within(surface, node, scene.tip_radius);
    result.sites_at_fixed_nodes +=
        std::any_of(within.begin(), within.end(), [&](int near) { return fixed[static_cast<size_t>(near)]; });
    for (const int near : within) {
      if (fixed[static_cast<size_t>(near)]) continue;
      site.patch.push_back(packed_of[static_cast<size_t>(near)]);
      is_contact[static_cast<size_t>(site.patch.back())] = 1;
    }
    result.sites.push_back(std::move(site));
  }
  std::vector<int> contact_of(result.packed_nodes.size(), -1);
  for (size_t packed = 0; packed < is_contact.size(); ++packed) {
    if (!is_contact[packed]) continue;
    contact_of[packed] = static_cast<int>(result.contact_nodes.size());
    result.contact_nodes.push_back(static_cast<int>(packed));
  }
  for (ContactSite& site : result.sites) {
    for (int& member : site.patch) member = contact_of[static_cast<size_t>(member)];
    std::sort(site.patch.begin(), site.patch.end());
    for (const int member : site.patch) site.patch_nodes.push_back(result.model_node(member));
  }
  for (const std::array<int, 3>& triangle : surface.triangles) {
    std::array<int, 3> packed;
    for (size_t corner = 0; corner < 3; ++corner)
      packed[corner] = packed_of[static_cast<size_t>(triangle[corner])];
    if (*std::min_element(packed.begin(), packed.end()) >= 0) result.triangles.push_back(packed);
  }
  return result;
}

Eigen::MatrixXd packed_rows(const ContactSites& sites, const Eigen::MatrixXd& all) {
  Eigen::MatrixXd rows(3 * static_cast<Eigen::Index>(sites.packed_nodes.size()), all.cols());
  for (size_t i = 0; i < sites.packed_nodes.size(); ++i)
    rows.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = all.middleRows<3>(3 * sites.packed_nodes[i]);
  return rows;
}

}  // namespace palpate
