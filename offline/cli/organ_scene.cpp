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

std::vector<int> touchable_nodes(const Model& model, const std::vector<int>& nodes) {
  const Surface surface = extract_surface(model);
  std::vector<int> touched;
  std::set_intersection(nodes.begin(), nodes.end(), surface.nodes.begin(), surface.nodes.end(),
                        std::back_inserter(touched));
  const std::vector<char> is_fixed = model.fixed_nodes();
  std::erase_if(touched, [&](int node) { return is_fixed[static_cast<size_t>(node)] != 0; });
  return touched;
}

std::vector<int> probed_nodes(const Model& model, const std::string& place) {
  std::vector<int> touched = touchable_nodes(model, select_nodes(model, place, "--probe"));
  if (touched.empty())
    throw std::runtime_error("--probe '" + place +
                             "': holds no free node of the surface; choose a larger place");
  return touched;
}

void add_loose_parts(const OrganFile& organ, const OrganCheck& check, std::vector<std::string>& faults) {
  const std::string& file = organ.model.file;
  if (organ.has_laws && organ.model.fixed.empty()) {
    faults.push_back(file + ": " + kNothingHeld);
    return;
  }
  int num_loose = 0;
  for (const PartCheck& part : check.parts) {
    if (part.free_motions.empty() || ++num_loose > kMostListed) continue;
    faults.push_back(fmt::format("{}: the part with node {} ({} nodes) can still {}; hold more of it with {}",
                                 file, part.first_node, part.num_nodes, part.free_motions.front(),
                                 organ.has_laws ? "*BOUNDARY"
                                 : check.parts.size() > 1
                                     ? "--fix, or drop the smaller parts with --keep largest"
                                     : "--fix"));
  }
  if (num_loose > kMostListed)
    faults.push_back(fmt::format("{}: ... and {} more", file, num_loose - kMostListed));
}

std::string moduli_warning(const OrganFile& organ, const Units& units) {
  constexpr double kSoftest = 0.05, kStiffest = 1000;  // kPa: from lung and fat to cartilage
  if (!organ.moduli.has_young) return {};
  const auto [least, largest] =
      std::ranges::minmax_element(organ.moduli.groups, {}, &ElementModuli::Group::young);
  const double from = least->young / units.kilopascal, to = largest->young / units.kilopascal;
  if (from < kStiffest && to > kSoftest) return {};
  return fmt::format(
      "{}: the array E goes from {:.4g} to {:.4g}, which in {}, the unit with lengths in {}, no soft tissue "
      "has; if it "
      "is in {}, multiply it by {:g}",
      organ.model.file, least->young, largest->young, units.pressure, units.length,
      from >= kStiffest ? "Pa" : "kPa", from >= kStiffest ? units.kilopascal / 1000 : units.kilopascal);
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
