#include "offline/precompute/patch_reach.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "offline/mesh/tetrahedron_shape.hpp"
#include "offline/precompute/nonlinear_zone.hpp"
#include "offline/precompute/sampling.hpp"

namespace palpate {
namespace {

// Returns the largest decrease of det F for |d| = 1, over the displacements that the scene permits.
double steepest_decrease(const Eigen::Vector3d& g, const Scene& scene, const ContactSite& site) {
  const double inward = g.dot(site.inward);
  if (scene.directions == Directions::all || inward <= 0) return g.norm();
  return (g - inward * site.inward).norm();
}

template <int kNodes>
double largest_decrease(const Model& model, const Tetrahedron& element, const std::vector<char>& in_patch,
                        const Scene& scene, const ContactSite& site) {
  typename TetrahedronShape<kNodes>::Nodal positions;
  for (int a = 0; a < kNodes; ++a)
    positions.col(a) = model.positions[static_cast<size_t>(element.nodes()[static_cast<size_t>(a)])];
  double largest = 0;
  for (int point = 0; point < TetrahedronShape<kNodes>::kPoints; ++point) {
    const ShapeAtPoint<kNodes> shape(positions, point);
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (int a = 0; a < kNodes; ++a) {
      if (in_patch[static_cast<size_t>(element.nodes()[static_cast<size_t>(a)])] != 0)
        g += shape.gradients.col(a);
    }
    largest = std::max(largest, steepest_decrease(g, scene, site));
  }
  return largest;
}

// Marks the nodes with all three dofs fixed.
std::vector<char> clamped_nodes(const Model& model) {
  const std::vector<char> dofs = model.fixed_dofs();
  std::vector<char> nodes(static_cast<size_t>(model.num_nodes()));
  for (size_t node = 0; node < nodes.size(); ++node)
    nodes[node] = std::all_of(&dofs[3 * node], &dofs[3 * node] + 3, [](char held) { return held != 0; });
  return nodes;
}

}  // namespace

std::vector<double> patch_reaches(const Scene& scene, const Model& model, const ContactSites& sites) {
  std::vector<double> reaches(sites.sites.size(), std::numeric_limits<double>::infinity());
  if (model.small_strain()) return reaches;
  const ZoneFinder finder(model);
  const std::vector<char> clamped = clamped_nodes(model);
  std::vector<char> in_patch(clamped.size(), 0);
  for (size_t i = 0; i < reaches.size(); ++i) {
    const ContactSite& site = sites.sites[i];
    for (const int node : site.patch_nodes) in_patch[static_cast<size_t>(node)] = 1;
    const auto is_held = [&](int node) {
      return in_patch[static_cast<size_t>(node)] != 0 || clamped[static_cast<size_t>(node)] != 0;
    };
    double largest = 0;
    for (const int e : finder.elements_about(site, 1)) {
      const Tetrahedron& element = model.elements[static_cast<size_t>(e)];
      if (!std::ranges::all_of(element.nodes(), is_held)) continue;
      largest = std::max(largest, element.num_nodes == 4
                                      ? largest_decrease<4>(model, element, in_patch, scene, site)
                                      : largest_decrease<10>(model, element, in_patch, scene, site));
    }
    // Rounding leaves a tiny g where the patch holds all nodes of an element; the reach is then huge.
    if (largest > 0) reaches[i] = (1 - kLeastSampledJacobian) / largest;
    for (const int node : site.patch_nodes) in_patch[static_cast<size_t>(node)] = 0;
  }
  return reaches;
}

}  // namespace palpate
