#include "offline/mesh/model_check.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "offline/mesh/element_faces.hpp"
#include "offline/mesh/geometry_check.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/rigid_motion.hpp"
#include "offline/mesh/tetrahedron_shape.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// An element is flat below this ratio of volume to longest edge cubed (regular element: 0.118). Coordinates
// with seven digits give a flat element about 1e-7.
constexpr double kFlat = 1e-8;

const Eigen::Vector3d& position(const Model& model, int node) {
  return model.positions[static_cast<std::size_t>(node)];
}

int label(const Model& model, int node) {
  return model.labels[static_cast<std::size_t>(node)];
}

double longest_edge(const Model& model, const Tetrahedron& element) {
  double longest = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Eigen::Vector3d edge =
          position(model, element.corners()[i]) - position(model, element.corners()[j]);
      longest = std::max(longest, edge.norm());
    }
  }
  return longest;
}

// Whether each integration point of a ten-node element has a volume above rounding.
bool has_positive_volumes(const Model& model, const Tetrahedron& element) {
  const double edge = longest_edge(model, element);
  Eigen::Matrix<double, 3, 10> positions;
  for (int a = 0; a < 10; ++a)
    positions.col(a) = position(model, element.node_array[static_cast<std::size_t>(a)]);
  for (int point = 0; point < TetrahedronShape<10>::kPoints; ++point) {
    if (!(4 * ShapeAtPoint<10>(positions, point).volume > kFlat * edge * edge * edge)) return false;
  }
  return true;
}

void check_volumes(const Model& model, const ModelOrigin& origin) {
  for (std::size_t i = 0; i < model.elements.size(); ++i) {
    const Tetrahedron& element = model.elements[i];
    const auto fail = [&](const std::string& message) {
      throw InputError(origin.files.at(origin.elements[i]),
                       fmt::format("element {} {}", element.label, message));
    };
    std::vector<int> sorted(element.nodes().begin(), element.nodes().end());
    std::sort(sorted.begin(), sorted.end());
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
    if (twice != sorted.end()) fail(fmt::format("names node {} twice; correct it", label(model, *twice)));
    const double volume = signed_volume(model, element);
    const double edge = longest_edge(model, element);
    // The negated comparison also refuses an overflow of the cube or of a coordinate difference.
    if (!(std::abs(volume) > kFlat * edge * edge * edge)) {
      fail(fmt::format("is flat (volume {:.3g}, longest edge {:.3g}); remesh there", volume, edge));
    }
    if (volume < 0) fail(fmt::format("is inverted (volume {:.3g}); reorder its nodes", volume));
    if (element.num_nodes == 10 && !has_positive_volumes(model, element))
      fail(
          "is flat or inverted at an integration point; move its middle nodes towards the middles of its "
          "edges");
  }
}

void check_faces(const Model& model, const ModelOrigin& origin) {
  const std::vector<ElementFace> faces = sorted_faces(model);
  for (std::size_t i = 1; i < faces.size(); ++i) {
    const ElementFace& first = faces[i - 1];
    const ElementFace& second = faces[i];
    if (first.sorted != second.sorted) continue;
    const auto element = [&](const ElementFace& face) {
      return model.elements[static_cast<std::size_t>(face.element)].label;
    };
    const auto shown = fmt::format("the face of nodes {}, {}, {}", label(model, first.sorted[0]),
                                   label(model, first.sorted[1]), label(model, first.sorted[2]));
    if (i + 1 < faces.size() && faces[i + 1].sorted == second.sorted) {
      const ElementFace& third = faces[i + 1];
      throw InputError(origin.files.at(origin.elements[static_cast<std::size_t>(third.element)]),
                       fmt::format("non-manifold mesh: elements {}, {} and {} share {}; remove one of them",
                                   element(first), element(second), element(third), shown));
    }
    std::array<int, 3> first_middles = first.middles;
    std::array<int, 3> second_middles = second.middles;
    std::sort(first_middles.begin(), first_middles.end());
    std::sort(second_middles.begin(), second_middles.end());
    if (first_middles != second_middles) {
      throw InputError(
          origin.files.at(origin.elements[static_cast<std::size_t>(second.element)]),
          fmt::format("elements {} and {} share {} but not the nodes between them; give both the same "
                      "middle nodes, and no element of ten nodes a neighbour of four",
                      element(first), element(second), shown));
    }
    if (first.even == second.even) {
      throw InputError(
          origin.files.at(origin.elements[static_cast<std::size_t>(second.element)]),
          fmt::format("elements {} and {} overlap: both lie on the same side of {}; remove one of them",
                      element(first), element(second), shown));
    }
  }
}

void warn_unused_nodes(Model& model) {
  const std::vector<int> part = connected_parts(model);
  const auto unused = std::count(part.begin(), part.end(), -1);
  if (unused == 0) return;
  const auto first = std::find(part.begin(), part.end(), -1) - part.begin();
  model.warnings.push_back(
      fmt::format("{}: {} {} to no element and stay where they are; the first is node {}", model.file, unused,
                  unused == 1 ? "node belongs" : "nodes belong", label(model, static_cast<int>(first))));
}

// Linear tetrahedra are far too stiff above this Poisson ratio (docs/solver_validation.md).
constexpr double kLockingPoissonRatio = 0.45;

// Whether `second` releases a dof that `first` holds.
bool releases(const Step& first, const Step& second) {
  const auto before = [](const PrescribedDisplacement& a, const PrescribedDisplacement& b) {
    return std::pair(a.node, a.axis) < std::pair(b.node, b.axis);
  };
  return !std::includes(second.prescribed.begin(), second.prescribed.end(), first.prescribed.begin(),
                        first.prescribed.end(), before);
}

}  // namespace

std::vector<std::string> locking_messages(const Model& model) {
  std::vector<std::string> messages;
  std::vector<char> may_lock(model.materials.size(), 0);  // has four-node elements that share no volume
  for (const Tetrahedron& element : model.elements) {
    if (element.num_nodes == 4 && element.volume_patch < 0 && element.material >= 0)
      may_lock[static_cast<std::size_t>(element.material)] = 1;
  }
  for (std::size_t i = 0; i < may_lock.size(); ++i) {
    const Material& material = model.materials[i];
    if (!may_lock[i]) continue;
    const double nu = small_strain_moduli(material.law).poisson_ratio();
    if (nu <= kLockingPoissonRatio + 1e-12) continue;
    messages.push_back(
        fmt::format("{}: material {} has a Poisson ratio of {:.4g} at small strain; above {} tetrahedra of "
                    "four nodes lock, and forces come out too large; write MEAN DILATATION in its *SOLID "
                    "SECTION, or mesh with C3D10H",
                    model.file, printable(material.name), nu, kLockingPoissonRatio));
  }
  return messages;
}

double signed_volume(const Model& model, const Tetrahedron& element) {
  const std::span<const int, 4> corners = element.corners();
  const Eigen::Vector3d& origin = position(model, corners[0]);
  const Eigen::Vector3d a = position(model, corners[1]) - origin;
  const Eigen::Vector3d b = position(model, corners[2]) - origin;
  const Eigen::Vector3d c = position(model, corners[3]) - origin;
  return a.dot(b.cross(c)) / 6;
}

void check_held(const Model& model, const std::vector<PrescribedDisplacement>& held,
                const SourceLine& where) {
  const std::vector<LoosePart> loose = loose_parts(model, held);
  if (loose.empty()) return;
  // A part that was meant to be joined to another must not be nailed in space instead.
  const UnjoinedGeometry found = find_unjoined(model);
  for (const LoosePart& part : loose) {
    const std::string contact = part_contact(model, found, part.node);
    if (contact.empty()) continue;
    throw InputError(where, fmt::format("the part with node {} can still {}, and {}", label(model, part.node),
                                        part.motions.front(), contact));
  }
  throw InputError(where, fmt::format("the part with node {} can still {}; hold more of it with *BOUNDARY",
                                      label(model, loose.front().node), loose.front().motions.front()));
}

std::string hinged_message(const Model& model, const std::vector<PrescribedDisplacement>& held) {
  const std::vector<LoosePart> hinged = hinged_parts(model, held);
  if (hinged.empty()) return {};
  return fmt::format(
      "{}: the elements at node {} hang on the rest by a corner or an edge and can {}{}; join them face to "
      "face, or hold them with *BOUNDARY",
      model.file, label(model, hinged.front().node), hinged.front().motions.front(),
      hinged.size() > 1 ? fmt::format(", and so do {} groups more", hinged.size() - 1) : "");
}

void check_elements(const Model& model, const ModelOrigin& origin) {
  check_volumes(model, origin);
  check_faces(model, origin);
}

void check_model(Model& model, const ModelOrigin& origin) {
  if (model.elements.empty()) {
    throw InputError({model.file, 0}, "the model has no elements; add *ELEMENT, TYPE=C3D4");
  }
  check_elements(model, origin);
  const auto& held = model.steps.empty() ? model.fixed : model.steps.front().prescribed;
  check_held(model, held, {model.file, 0});
  if (std::string message = hinged_message(model, held); !message.empty())
    model.warnings.push_back(std::move(message));
  for (std::size_t i = 1; i < model.steps.size(); ++i) {
    if (releases(model.steps[i - 1], model.steps[i]))
      check_held(model, model.steps[i].prescribed, model.steps[i].source);
  }
  warn_unused_nodes(model);
  for (std::string& message : locking_messages(model)) model.warnings.push_back(std::move(message));
}

}  // namespace palpate
