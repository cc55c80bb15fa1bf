// Maps between sites by eq. (25), which no pack uses, where its system is singular or nearly so.
#include <fmt/core.h>

#include <Eigen/LU>

#include "offline/precompute/affine_site.hpp"
#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"

namespace palpate::hard {
namespace {

// A map must take the contact's position to the site's, or the reverse, as the paper prints it. Otherwise the
// map must be empty, or its condition must state the lost digits.
Answer place(const std::string& by, const Model& model, const ContactSites& sites, SiteMap map, size_t site,
             size_t contact) {
  const std::optional<Placement> found =
      place_contact(model, sites, map, sites.sites[site], sites.sites[contact]);
  if (!found) return refused(by, "the map is singular: there is none");
  Answer answer;
  answer.by = by;
  const Eigen::Vector3d& s = model.positions[static_cast<size_t>(sites.sites[site].node)];
  const Eigen::Vector3d& t = model.positions[static_cast<size_t>(sites.sites[contact].node)];
  const auto image = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return found->at_site + found->of_places * (p - found->at_contact);
  };
  const double h = sites.mean_surface_edge;
  answer.finite =
      found->of_places.allFinite() && found->of_vectors.allFinite() && std::isfinite(found->condition);
  answer.displacement_error = (map == SiteMap::printed ? image(s) - t : image(t) - s).norm() / h;
  answer.happened = fmt::format("condition {:.2g}", found->condition);
  constexpr double kIllConditioned = 1e3;
  if (found->condition > kIllConditioned) answer.flags = {answer.happened};
  return answer;
}

// The top of a flat block moved to `origin`, with neighbouring sites.
std::vector<Answer> all_maps(const Eigen::Vector3d& origin, double away) {
  OrganSpec spec = touched(unit_block(6, kTissue, 0), 0.1, 0);
  for (Eigen::Vector3d& position : spec.model.positions)
    position += away * Eigen::Vector3d(1, -0.7, 0.4) - origin;
  Scene scene;
  scene.sites = spec.sites;
  scene.max_displacement = 0.1;
  scene.output_nodes = extract_surface(spec.model).nodes;
  const ContactSites sites = find_contact_sites(scene, spec.model);
  const size_t site = 12;
  const size_t contact = 13;
  return {place("rigid", spec.model, sites, SiteMap::rigid, site, contact),
          place("affine", spec.model, sites, SiteMap::affine, site, contact),
          place("eq. (25) as printed", spec.model, sites, SiteMap::printed, site, contact),
          place("eq. (25) inverse", spec.model, sites, SiteMap::inverse, site, contact)};
}

}  // namespace

Group map_cases() {
  Group group{
      "map",
      "Singular affine configurations",
      "The paper moves the answer of a sampled site to a contact nearby by eq. (25), which is linear "
      "through the origin: it is singular where the site lies there or the nodes lie in a plane with it, "
      "and loses digits far from it; then there is none, or its condition tells. It is kept to be "
      "compared with, as are two maps that do not depend on the origin: rigid, along with the surface, "
      "and affine about the site. No pack is built by any of them. Where nothing was sampled a pack "
      "carries the series at rest of the contact itself (affine_site, the group of sites where nothing "
      "was sampled); the field between sites is the blend of theirs. Error: how far the map takes the one "
      "site from the other, in edges.",
      {}};
  const Bar bar = {1e-6, 1e-6};
  const auto add = [&](const std::string& name, const std::string& hard, const Eigen::Vector3d& origin,
                       double away) {
    group.cases.push_back(
        {"map", name, hard, bar, Expected::answer, "", [=] { return all_maps(origin, away); }});
  };
  const Eigen::Vector3d at_site(0.5, 0.5, 1);
  add("ordinary", "origin in the middle of the block", {0.5, 0.5, 0.4}, 0);
  add("at_the_site", "origin at the site", at_site, 0);
  add("at_the_contact", "origin at the contact", {4.0 / 6, 0.5, 1}, 0);
  add("coplanar", "origin in the plane of the surface, so that all nodes on it are coplanar with the origin",
      {-0.3, -0.2, 1}, 0);
  add("nearly_coplanar", "origin 1e-9 below the plane of the surface", {-0.3, -0.2, 1 - 1e-9}, 0);
  add("far_1e3", "1e3 sides from the origin", at_site, 1e3);
  add("far_1e6", "1e6 sides from the origin", at_site, 1e6);
  add("far_1e9", "1e9 sides from the origin", at_site, 1e9);
  return group;
}

}  // namespace palpate::hard
