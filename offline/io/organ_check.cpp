#include "offline/io/organ_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "offline/mesh/disjoint_sets.hpp"
#include "offline/mesh/element_faces.hpp"
#include "offline/mesh/geometry_check.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/rigid_motion.hpp"
#include "offline/mesh/surface.hpp"

namespace palpate {
namespace {

// Returns the angles, degrees, between the faces of a tetrahedron at its six edges.
std::array<double, 6> dihedral_angles(const Model& model, const Tetrahedron& element) {
  std::array<Eigen::Vector3d, 4> normals;
  for (int face = 0; face < 4; ++face) {
    const std::array<int, 6> nodes = outward_face(element, face);
    const auto at = [&](size_t i) { return model.positions[static_cast<size_t>(nodes[i])]; };
    normals[static_cast<size_t>(face)] = (at(1) - at(0)).cross(at(2) - at(0)).normalized();
  }
  std::array<double, 6> angles;
  size_t next = 0;
  for (size_t a = 0; a < 4; ++a) {
    for (size_t b = a + 1; b < 4; ++b) {
      const double cosine = std::clamp(-normals[a].dot(normals[b]), -1.0, 1.0);
      angles[next++] = std::acos(cosine) * 180 / std::numbers::pi;
    }
  }
  return angles;
}

void count_angles(const Model& model, OrganCheck& check) {
  std::vector<std::pair<double, int>> smallest;  // (angle, label)
  for (const Tetrahedron& element : model.elements) {
    const std::array<double, 6> angles = dihedral_angles(model, element);
    for (const double angle : angles) ++check.angles[std::min<size_t>(17, static_cast<size_t>(angle / 10))];
    const auto [least, largest] = std::minmax_element(angles.begin(), angles.end());
    check.least_angle = std::min(check.least_angle, *least);
    check.largest_angle = std::max(check.largest_angle, *largest);
    if (*least < kSliverAngle) smallest.emplace_back(*least, element.label);
  }
  check.num_slivers = static_cast<int>(smallest.size());
  std::sort(smallest.begin(), smallest.end());
  for (const auto& [angle, label] : smallest) {
    if (check.slivers.size() < kMostListed) check.slivers.push_back(label);
  }
}

// Returns the number of edges that do not have exactly two triangles.
int count_open_edges(const Surface& surface) {
  std::vector<std::pair<int, int>> edges;
  for (const std::array<int, 3>& triangle : surface.triangles) {
    for (size_t i = 0; i < 3; ++i) edges.push_back(std::minmax(triangle[i], triangle[(i + 1) % 3]));
  }
  std::sort(edges.begin(), edges.end());
  int open = 0;
  for (size_t i = 0; i < edges.size();) {
    size_t end = i;
    while (end < edges.size() && edges[end] == edges[i]) ++end;
    open += end - i == 2 ? 0 : 1;
    i = end;
  }
  return open;
}

// Counts connected surfaces, and those that enclose no volume of the organ: the walls of cavities.
void count_shells(const Model& model, const Surface& surface, OrganCheck& check) {
  DisjointSets shells(model.positions.size());
  for (const auto& [a, b, c] : surface.triangles) {
    shells.unite(a, b);
    shells.unite(a, c);
  }
  std::map<int, double> volumes;  // six times that inside a shell; below 0 where it faces inwards
  const Eigen::Vector3d origin = check.box.center();
  for (const std::array<int, 3>& triangle : surface.triangles) {
    const auto at = [&](size_t i) -> Eigen::Vector3d {
      return model.positions[static_cast<size_t>(triangle[i])] - origin;
    };
    volumes[shells.root(triangle[0])] += at(0).dot(at(1).cross(at(2)));
  }
  check.num_shells = static_cast<int>(volumes.size());
  for (const auto& [shell, volume] : volumes) check.num_cavities += volume < 0 ? 1 : 0;
}

// Returns the number of nodes whose triangles form more than one fan. A fan joins the triangles of a node
// that share an edge at the node.
int count_shared_nodes(const Surface& surface) {
  struct Spoke {
    std::pair<int, int> edge;  // of a node, to another node
    int corner;                // 3 triangle + place of the node in it
  };
  std::vector<Spoke> spokes;
  for (size_t triangle = 0; triangle < surface.triangles.size(); ++triangle) {
    const std::array<int, 3>& nodes = surface.triangles[triangle];
    for (size_t i = 0; i < 3; ++i) {
      for (const size_t other : {(i + 1) % 3, (i + 2) % 3})
        spokes.push_back({{nodes[i], nodes[other]}, static_cast<int>(3 * triangle + i)});
    }
  }
  std::sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) { return a.edge < b.edge; });
  DisjointSets fans(3 * surface.triangles.size());
  for (size_t i = 1; i < spokes.size(); ++i) {
    if (spokes[i].edge == spokes[i - 1].edge) fans.unite(spokes[i].corner, spokes[i - 1].corner);
  }
  std::map<int, int> num_fans;  // of each node
  for (int corner = 0; corner < 3 * static_cast<int>(surface.triangles.size()); ++corner) {
    if (fans.root(corner) == corner)
      ++num_fans[surface.triangles[static_cast<size_t>(corner / 3)][static_cast<size_t>(corner % 3)]];
  }
  return static_cast<int>(
      std::count_if(num_fans.begin(), num_fans.end(), [](const auto& entry) { return entry.second > 1; }));
}

void check_parts(const Model& model, const std::vector<PrescribedDisplacement>& held, OrganCheck& check) {
  const std::vector<int> part = connected_parts(model);
  for (size_t node = 0; node < part.size(); ++node) {
    if (part[node] < 0) continue;
    if (part[node] == static_cast<int>(check.parts.size())) {
      check.parts.emplace_back();
      check.parts.back().first_node = model.labels[node];
    }
    PartCheck& of_node = check.parts[static_cast<size_t>(part[node])];
    ++of_node.num_nodes;
    of_node.box.extend(model.positions[node]);
  }
  const auto part_of = [&](int node) -> PartCheck& {
    return check.parts[static_cast<size_t>(part[static_cast<size_t>(node)])];
  };
  for (const Tetrahedron& element : model.elements) ++part_of(element.node_array[0]).num_elements;
  for (LoosePart& loose : loose_parts(model, held)) part_of(loose.node).free_motions = loose.motions;
  std::stable_sort(check.parts.begin(), check.parts.end(),
                   [](const PartCheck& a, const PartCheck& b) { return a.num_elements > b.num_elements; });
  std::set<int> nodes;
  for (const PrescribedDisplacement& dof : held) nodes.insert(dof.node);
  check.num_held_nodes = static_cast<int>(nodes.size());
}

// Warns of nearly incompressible elements whose shared volumes have few elements, as a pattern of materials
// that changes from element to element makes them.
void warn_small_patches(const Model& model, OrganCheck& check) {
  constexpr int kFewElements = 4;  // docs/solver_validation.md
  constexpr double kLockingRatio = 0.45;
  std::map<int, int> patches;
  for (const Tetrahedron& element : model.elements) ++patches[element.volume_patch];
  const auto locks = [&](const Tetrahedron& element) {
    return element.num_nodes == 4 && element.volume_patch >= 0 &&
           patches[element.volume_patch] < kFewElements &&
           small_strain_moduli(model.materials[static_cast<size_t>(element.material)].law).poisson_ratio() >
               kLockingRatio;
  };
  const auto count = std::count_if(model.elements.begin(), model.elements.end(), locks);
  if (static_cast<double>(count) < 0.1 * static_cast<double>(model.elements.size()) || count == 0) return;
  check.warnings.push_back(fmt::format(
      "{}: {} of {} elements share their volume with fewer than {} others of their material and may lock, so "
      "that forces come out too large; use fewer materials, or elements of ten nodes",
      model.file, count, model.elements.size(), kFewElements - 1));
}

// Collects the faults that stop a build, and its warnings.
void find_faults(const Model& model, const std::vector<PrescribedDisplacement>& held, OrganCheck& check) {
  try {
    check_elements(model, whole_file_origin(model));
  } catch (const InputError& error) {
    check.faults.emplace_back(error.what());
    return;  // the searches below need elements with a volume
  }
  check.faults = unjoined_messages(model, find_unjoined(model));
  const auto is_held = [](const PartCheck& part) { return part.free_motions.empty(); };
  if (std::all_of(check.parts.begin(), check.parts.end(), is_held)) {
    if (std::string message = hinged_message(model, held); !message.empty())
      check.faults.push_back(std::move(message));
  }
  for (std::string& message : locking_messages(model)) check.warnings.push_back(std::move(message));
  warn_small_patches(model, check);
}

}  // namespace

ModelOrigin whole_file_origin(const Model& model) {
  ModelOrigin origin;
  const Place whole = {origin.files.add(model.file), 0};
  origin.elements.assign(model.elements.size(), whole);
  return origin;
}

OrganCheck check_organ(const Model& model, const std::vector<PrescribedDisplacement>& held) {
  OrganCheck check;
  check.num_nodes = model.num_nodes();
  check.num_elements = static_cast<int>(model.elements.size());
  for (const Eigen::Vector3d& position : model.positions) check.box.extend(position);
  for (const Tetrahedron& element : model.elements) {
    check.num_quadratic += element.num_nodes == 10 ? 1 : 0;
    check.volume += signed_volume(model, element);
  }
  const Surface surface = extract_surface(model);
  check.num_surface_nodes = static_cast<int>(surface.nodes.size());
  check.mean_edge = surface.mean_edge;
  check.num_open_edges = count_open_edges(surface);
  check.num_shared_nodes = count_shared_nodes(surface);
  count_shells(model, surface, check);
  check_parts(model, held, check);
  find_faults(model, held, check);
  count_angles(model, check);
  return check;
}

}  // namespace palpate
