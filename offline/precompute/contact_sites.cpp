#include "offline/precompute/contact_sites.hpp"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>
#include <string>

#include "offline/precompute/patch_reach.hpp"

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

// Returns ContactSites::triangles. packed_of: the packed node of each node of the model, or -1.
std::vector<std::array<int, 3>> packed_triangles(const Surface& surface, const std::vector<int>& packed_of) {
  std::vector<std::array<int, 3>> triangles;
  for (const std::array<int, 3>& triangle : surface.triangles) {
    std::array<int, 3> packed;
    for (size_t corner = 0; corner < 3; ++corner)
      packed[corner] = packed_of[static_cast<size_t>(triangle[corner])];
    if (*std::min_element(packed.begin(), packed.end()) >= 0) triangles.push_back(packed);
  }
  return triangles;
}

// Moves the sites whose patch an element stops to ContactSites::left_out. Their nodes remain contact nodes.
void leave_out_immobile(const Scene& scene, const Model& model, ContactSites& sites) {
  const double least = kLeastReachPart * scene.max_displacement;
  const std::vector<double> reaches = patch_reaches(scene, model, sites);
  std::vector<ContactSite> left;
  for (size_t i = 0; i < reaches.size(); ++i) {
    if (reaches[i] < least) {
      sites.left_out.push_back({sites.sites[i].node, reaches[i]});
    } else {
      left.push_back(std::move(sites.sites[i]));
    }
  }
  sites.sites = std::move(left);
  if (sites.sites.empty() && !sites.left_out.empty())
    throw std::runtime_error(left_out_text(scene, model, sites.left_out, 0));
}

}  // namespace

std::string left_out_text(const Scene& scene, const Model& model, const std::vector<LeftOutSite>& left_out,
                          size_t num_left) {
  constexpr size_t kShown = 5;
  std::string names;
  for (size_t i = 0; i < std::min(kShown, left_out.size()); ++i)
    names += fmt::format("{}{} ({:.3g})", i > 0 ? ", " : "",
                         model.labels[static_cast<size_t>(left_out[i].node)], left_out[i].out_of_reach);
  if (left_out.size() > kShown)
    names += fmt::format(" and {} more (build --json names all)", left_out.size() - kShown);
  return fmt::format(
      "{}: {} of {} sites are left out, as their patches cannot move by a quarter of max_displacement = {:g} "
      "in every direction: nodes, with the |d| out of reach: {}; {} left; reduce max_displacement to keep "
      "them, or release fixed nodes beside them",
      scene.file.string(), left_out.size(), left_out.size() + num_left, scene.max_displacement, names,
      num_left == 0   ? "no site is"
      : num_left == 1 ? "1 site is"
                      : fmt::format("{} sites are", num_left));
}

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
  result.triangles = packed_triangles(surface, packed_of);
  leave_out_immobile(scene, model, result);
  return result;
}

Eigen::MatrixXd packed_rows(const ContactSites& sites, const Eigen::MatrixXd& all) {
  Eigen::MatrixXd rows(3 * static_cast<Eigen::Index>(sites.packed_nodes.size()), all.cols());
  for (size_t i = 0; i < sites.packed_nodes.size(); ++i)
    rows.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = all.middleRows<3>(3 * sites.packed_nodes[i]);
  return rows;
}

}  // namespace palpate
