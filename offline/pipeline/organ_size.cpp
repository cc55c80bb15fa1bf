#include "offline/pipeline/organ_size.hpp"

#include <fmt/core.h>

#include <Eigen/Geometry>

namespace palpate {
namespace {

// Organs from an ossicle to a whole body, in metres.
constexpr double kShortestOrgan = 1e-3;
constexpr double kLongestOrgan = 2;

std::string unit_suffix(const Scene& scene) {
  return scene.length_unit.empty() ? "" : " " + scene.length_unit;
}

// Names the unit in which a body of this length is nearest to the size of an ordinary organ.
std::string likely_unit(double length) {
  if (length < 1) return "m";
  return length < 30 ? "cm" : length < 2000 ? "mm" : "um";
}

}  // namespace

Eigen::Vector3d organ_size(const Model& model) {
  Eigen::AlignedBox3d box;
  for (const Tetrahedron& element : model.elements) {
    for (const int node : element.nodes()) box.extend(model.positions[static_cast<size_t>(node)]);
  }
  return box.sizes();
}

std::string size_text(const Scene& scene, const Model& model, double mean_surface_edge) {
  const Eigen::Vector3d size = organ_size(model);
  const std::string unit = unit_suffix(scene);
  const double percent = 100 * scene.max_displacement / size.maxCoeff();
  return fmt::format("organ {:.3g} x {:.3g} x {:.3g}{}; |d| to {:.4g}{}: {:.2f} h, {} % of it", size.x(),
                     size.y(), size.z(), unit, scene.max_displacement, unit,
                     scene.max_displacement / mean_surface_edge,
                     percent < 10 ? fmt::format("{:.2g}", percent) : fmt::format("{:.0f}", percent));
}

std::vector<std::string> size_warnings(const Scene& scene, const Model& model, double mean_surface_edge) {
  std::vector<std::string> warnings;
  const Eigen::Vector3d size = organ_size(model);
  const double length = size.maxCoeff();
  const double metres = length * scene.metres_per_length_unit;
  const std::string unit = unit_suffix(scene);
  const std::string organ =
      fmt::format("the organ is {:.3g} x {:.3g} x {:.3g}{}", size.x(), size.y(), size.z(), unit);
  if (!scene.length_unit.empty() && (metres < kShortestOrgan || metres > kLongestOrgan)) {
    const std::string likely = likely_unit(length);
    warnings.push_back(fmt::format(
        "{}: {}, {}; correct [units] length{}", scene.file.string(), organ,
        metres < kShortestOrgan ? "below 1 mm" : "above 2 m",
        likely == scene.length_unit ? "" : fmt::format(", if {} has its numbers in {}", model.file, likely)));
  }
  if (scene.max_displacement > length) {
    warnings.push_back(fmt::format(
        "{}: max_displacement = {:g}{} is {:.3g} mean edges and {:.3g} times the organ: {}; state "
        "it in the unit of {}",
        scene.file.string(), scene.max_displacement, unit, scene.max_displacement / mean_surface_edge,
        scene.max_displacement / length, organ, model.file));
  }
  return warnings;
}

std::string tip_text(double tip_radius, double mean_surface_edge, const std::string& unit) {
  return fmt::format(
      "the tip (tip_radius = {:g}{}) is smaller than an edge (h = {:.4g}{}): the force is a property of the "
      "mesh",
      tip_radius, unit, mean_surface_edge, unit);
}

}  // namespace palpate
