// The runtime's view of a touchable surface, without the solves of a whole pack.
#pragma once

#include <utility>
#include <vector>

#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/scene.hpp"
#include "offline/precompute/surface_bvh.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate::test {

struct TouchableSurface {
  // Sites at these surface nodes of the model.
  TouchableSurface(const Model& model, std::vector<int> nodes) : surface(extract_surface(model)) {
    Scene scene;
    scene.sites = std::move(nodes);
    scene.output_nodes = surface.nodes;
    sites = find_contact_sites(scene, model);
    bvh = build_surface_bvh(model, surface, sites);
    for (const int node : sites.packed_nodes) {
      const Eigen::Vector3d& x = model.positions[static_cast<std::size_t>(node)];
      positions.insert(positions.end(), x.begin(), x.end());
    }
    show();
  }

  // A site at every surface node.
  explicit TouchableSurface(const Model& model) : TouchableSurface(model, extract_surface(model).nodes) {}

  TouchableSurface(const TouchableSurface&) = delete;
  TouchableSurface& operator=(const TouchableSurface&) = delete;

  std::size_t size() const { return bvh.primitives.size(); }
  Eigen::Vector3d site(std::size_t index) const {
    return Eigen::Vector3d(&positions[3 * static_cast<std::size_t>(site_nodes[index])]);
  }

  Surface surface;  // the model's whole surface
  ContactSites sites;
  SurfaceBvh bvh;
  std::vector<double> positions;
  std::vector<uint32_t> site_nodes;
  pal_pack pack = {};  // holds nothing but this surface

 private:
  void show() {
    for (const ContactSite& site : sites.sites) site_nodes.push_back(static_cast<uint32_t>(site.packed_node));
    pack.num_nodes = static_cast<uint32_t>(positions.size() / 3);
    pack.positions = pack.rest_positions = positions.data();
    pack.num_sites = static_cast<uint32_t>(site_nodes.size());
    pack.site_nodes = site_nodes.data();
    pack.num_primitives = static_cast<uint32_t>(bvh.primitives.size());
    pack.num_bvh_nodes = static_cast<uint32_t>(bvh.nodes.size());
    pack.primitives = bvh.primitives.data()->data();
    pack.bvh_nodes = bvh.nodes.data();
    pack.primitive_normals = bvh.primitive_normals.data()->data()->data();
    pack.site_normals = bvh.site_normals.data()->data();
  }
};

}  // namespace palpate::test
