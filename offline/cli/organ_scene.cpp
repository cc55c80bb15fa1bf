#include "offline/cli/organ_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "offline/io/node_selection.hpp"
#include "offline/mesh/rigid_motion.hpp"
#include "offline/mesh/surface.hpp"
#include "offline/mesh/volume_patches.hpp"

namespace palpate {
namespace {

CompressibleNeoHookean law_of(double young, double nu) {
  return {young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu))};
}

// Rounds to two digits, for numbers that people read.
double two_digits(double value) {
  return std::stod(fmt::format("{:.2g}", value));
}

// Names the element set of each material, with a name that the mesh does not have yet.
void add_material_sets(Model& model) {
  std::string prefix = "TISSUE_";
  const auto is_taken = [&] {
    const auto next = model.element_sets.lower_bound(prefix);
    return next != model.element_sets.end() && next->first.starts_with(prefix);
  };
  while (is_taken()) prefix += '_';
  for (size_t i = 0; i < model.materials.size(); ++i)
    model.materials[i].name = fmt::format("{}{}", prefix, i + 1);
  for (size_t i = 0; i < model.elements.size(); ++i)
    model.element_sets[model.materials[static_cast<size_t>(model.elements[i].material)].name].push_back(
        static_cast<int>(i));
}

}  // namespace

const Units& units_of(const std::string& length) {
  return *std::find_if(kUnits.begin(), kUnits.end(),
                       [&](const Units& units) { return length == units.length; });
}

const Tissue& tissue_of(const std::string& name) {
  return *std::find_if(kTissues.begin(), kTissues.end(),
                       [&](const Tissue& tissue) { return name == tissue.name; });
}

void set_tissue(OrganFile& organ, const Tissue& tissue, const Units& units) {
  Model& model = organ.model;
  const double mu = tissue.shear_modulus * units.kilopascal;
  model.materials.clear();
  model.fixed.clear();
  for (ElementModuli::Group& group : organ.moduli.groups) {
    if (!organ.moduli.has_young) group.young = 2 * mu * (1 + group.nu);
    model.materials.push_back({"", law_of(group.young, group.nu)});
  }
  if (organ.moduli.empty()) {
    model.materials.push_back(
        {"TISSUE", CompressibleNeoHookean{mu, 2 * mu * kTissueRatio / (1 - 2 * kTissueRatio)}});
    for (Tetrahedron& element : model.elements) element.material = 0;
  } else {
    for (size_t i = 0; i < model.elements.size(); ++i)
      model.elements[i].material = organ.moduli.group_of_element[i];
    add_material_sets(model);
  }
  std::vector<int> volume_groups;
  for (const Tetrahedron& element : model.elements)
    volume_groups.push_back(element.num_nodes == 4 ? element.material : -1);
  form_volume_patches(model, volume_groups);
}

HeldPlace find_held_place(const Model& model, const std::string& place) {
  if (!place.empty()) return {select_nodes(model, place, "--fix")};
  const auto set = model.node_sets.find(kFixedSet);
  if (set != model.node_sets.end() && !set->second.empty()) return {set->second};
  constexpr int kLargestGuess = 30;
  HeldPlace held;
  for (int percent = 10; percent <= kLargestGuess; percent += 10) {
    held = {select_nodes(model, fmt::format("z<{}%", percent), "--fix"), percent};
    if (loose_parts(model, held_dofs(held.nodes)).empty()) break;
  }
  return held;
}

std::vector<PrescribedDisplacement> held_dofs(const std::vector<int>& nodes) {
  std::vector<PrescribedDisplacement> held;
  for (const int node : nodes) {
    for (int axis = 0; axis < 3; ++axis) held.push_back({node, axis, 0});
  }
  return held;
}

std::vector<int> touchable_nodes(const Model& model, const std::string& place) {
  const std::vector<int> chosen = select_nodes(model, place, "--probe");
  const Surface surface = extract_surface(model);
  std::vector<int> touched;
  std::set_intersection(chosen.begin(), chosen.end(), surface.nodes.begin(), surface.nodes.end(),
                        std::back_inserter(touched));
  const std::vector<char> is_fixed = model.fixed_nodes();
  std::erase_if(touched, [&](int node) { return is_fixed[static_cast<size_t>(node)] != 0; });
  if (touched.empty())
    throw std::runtime_error("--probe '" + place +
                             "': holds no free node of the surface; choose a larger place");
  return touched;
}

Scene default_scene(const Model& model, std::vector<int> sites) {
  const Surface surface = extract_surface(model);
  Scene scene;
  scene.file = model.file;
  scene.model_file = model.file;
  scene.sites = std::move(sites);
  if (scene.sites.empty()) {
    const std::vector<char> is_fixed = model.fixed_nodes();
    std::copy_if(surface.nodes.begin(), surface.nodes.end(), std::back_inserter(scene.sites),
                 [&](int node) { return is_fixed[static_cast<size_t>(node)] == 0; });
  }
  scene.output_nodes = surface.nodes;
  scene.max_displacement = two_digits(0.5 * surface.mean_edge);
  scene.tip_radius = two_digits(1.2 * surface.mean_edge);
  scene.max_contacts = 2;
  scene.frame_budget_us = 200;
  scene.linear = model.small_strain();
  scene.polynomial = false;
  scene.zone = !model.small_strain();
  return scene;
}

}  // namespace palpate
