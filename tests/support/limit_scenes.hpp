// Bodies with limit points, and their closed forms: von Mises' truss, a shallow arch, a strip that buckles.
// Each is a bent block, modelled by half where it is symmetric.
//
//                P                                   P
//        stiff   v                                   v
//   z ^      __--+   apex, x held             ___----+   crown, x and turning held
//     |  __--    |                        _---       |
//     +--> x     (mirror)                /           (mirror)
//   hinge: a line of nodes held         clamped face
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "offline/fem/arc_length.hpp"
#include "tests/support/beam_scenes.hpp"

namespace palpate::test {

// A body, the force at load factor 1, and the dof (node, axis) that a path is plotted against.
struct PathScene {
  Model model;
  LoadCase load;
  int node = 0;
  int axis = 2;

  int dof() const { return 3 * node + axis; }
};

struct PathRun {
  SolveReport report;
  std::vector<PathPoint> points;
  std::vector<Eigen::VectorXd> states;  // displacement at each point

  double moved(std::size_t point, int dof) const { return states[point][dof]; }
};

inline PathRun follow_path(const PathScene& scene, const ArcLengthSettings& settings) {
  const Assembly assembly(scene.model, scene.model.fixed_dofs());
  ArcLength solver(assembly);
  PathRun run;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(scene.model.num_dofs());
  run.report = solver.follow(LoadCase::rest(scene.model), scene.load, u, settings,
                             [&](const PathPoint& point, const Eigen::VectorXd& displacement) {
                               run.points.push_back(point);
                               run.states.push_back(displacement);
                             });
  return run;
}

// Half of von Mises' truss (von Mises 1923): a bar of square section from a hinge to an apex that only moves
// in z. Stiff caps at both ends keep the local strain of hinge and load out of the bar.
struct Truss {
  double span = 10;  // of the half truss
  double rise = 1;
  double side = 1;  // of the section; a thinner bar would buckle before the truss snaps through
  double cap = 1;   // length of each stiff cap
  double young = 1;
  double stiffer = 1e4;  // stiffness of the caps over the bar's

  double length() const { return std::hypot(span, rise); }

  PathScene scene() const {
    constexpr int kCellsAlong = 10;
    BlockShape shape;
    shape.cells = {kCellsAlong, 1, 2};
    shape.size = {length(), side, side};
    shape.law = neo_hookean_of(young, 0);
    PathScene scene;
    scene.model = tetrahedral_block(shape);
    Model& model = scene.model;
    model.materials.push_back({"CAP", neo_hookean_of(stiffer * young, 0)});
    for (Eigen::Vector3d& position : model.positions) {
      position -= Eigen::Vector3d(0, 0.5 * side, 0.5 * side);
      // The end cells are the caps.
      const double cell = position.x() / length() * kCellsAlong;
      if (cell < 0.5 || cell > kCellsAlong - 0.5) continue;
      position.x() = cap + (cell - 1) / (kCellsAlong - 2) * (length() - 2 * cap);
    }
    for (std::size_t element = 0; element < model.elements.size(); ++element) {
      const std::size_t cell = element / 6 % kCellsAlong;
      if (cell == 0 || cell == kCellsAlong - 1) model.elements[element].material = 1;
    }
    model = with_middle_nodes(std::move(model));
    const Eigen::AngleAxisd up(-std::atan2(rise, span), Eigen::Vector3d::UnitY());
    scene.load = LoadCase::rest(model);
    for (int node = 0; node < model.num_nodes(); ++node) {
      Eigen::Vector3d& position = model.positions[static_cast<std::size_t>(node)];
      const bool on_axis = std::abs(position.z()) < 1e-9;
      const bool hinge = on_axis && std::abs(position.x()) < 1e-9;
      const bool apex = on_axis && std::abs(position.x() - length()) < 1e-9;
      if (apex && std::abs(position.y()) < 1e-9) scene.node = node;
      for (const int axis : {0, 1, 2}) {
        if (hinge || (apex && axis < 2)) model.fixed.push_back({node, axis, 0.0});
      }
      position = up * position;
    }
    scene.load = LoadCase::rest(model);
    return scene;
  }

  // Force on the half truss at the apex deflection w. Eq. (1) with nu = 0 gives the nominal stress E / 2 (s -
  // 1 / s) at stretch s and no lateral strain.
  double force(double w) const {
    const double now = std::hypot(span, rise - w);
    const double stretch = 1 + (now - length()) / (length() - 2 * cap);
    const double pull = side * side * 0.5 * young * (stretch - 1 / stretch);
    return -pull * (rise - w) / now;
  }
};

// The truss loaded through a soft column of four-node elements on its apex. A column softer than the truss's
// falling branch snaps back: its loaded end returns while the apex advances.
struct ColumnOnTruss {
  Truss truss;
  double height = 20;
  double young = 6e-3;

  // Sets `apex` to the node at y = 0 below the column. The scene's node is the loaded one above.
  PathScene scene(int& apex) const {
    PathScene scene = truss.scene();
    Model& model = scene.model;
    model.materials.push_back({"COLUMN", neo_hookean_of(young, 0)});
    std::vector<int> corners;  // x fastest, then y, then z
    for (const double z : {truss.rise, truss.rise + height}) {
      for (const double y : {-0.5 * truss.side, 0.5 * truss.side}) {
        for (const double x : {truss.span - 1, truss.span}) {
          const Eigen::Vector3d at(x, y, z);
          int node = 0;
          while (node < model.num_nodes() &&
                 (model.positions[static_cast<std::size_t>(node)] - at).norm() > 1e-9)
            ++node;
          corners.push_back(node);
          if (node < model.num_nodes()) continue;
          model.labels.push_back(model.labels.back() + 1);
          model.label_index.emplace_back(model.labels.back(), node);
          model.positions.push_back(at);
          for (const int axis : {0, 1}) model.fixed.push_back({node, axis, 0.0});
        }
      }
    }
    constexpr std::array<std::array<std::size_t, 4>, 6> kAroundDiagonal = {
        {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};
    for (const auto& element : kAroundDiagonal) {
      Tetrahedron column;
      column.label = model.elements.back().label + 1;
      column.material = 2;
      for (std::size_t a = 0; a < 4; ++a) column.node_array[a] = corners[element[a]];
      model.elements.push_back(column);
    }
    apex = corners[1];
    scene.node = corners[5];
    scene.load = LoadCase::rest(model);
    return scene;
  }
};

// Half of a clamped circular arch with rectangular section, loaded by shear on the plane of symmetry. Every
// node keeps its y coordinate (plane strain).
struct Arch {
  double half_angle = 0.2;
  double radius = 50;
  double thickness = 0.5;
  double width = 0.5;
  double young = 1;

  double length() const { return radius * half_angle; }  // of the half arch, along its axis
  double stretching_stiffness() const { return young * thickness * width; }
  double bending_stiffness() const { return young * width * std::pow(thickness, 3) / 12; }

  PathScene scene(int cells_along = 20, int cells_through = 1) const {
    BlockShape shape;
    shape.cells = {cells_along, 1, cells_through};
    shape.size = {length(), width, thickness};
    shape.law = neo_hookean_of(young, 0);
    PathScene scene;
    scene.model = with_middle_nodes(tetrahedral_block(shape));
    Model& model = scene.model;
    std::vector<int> crown;
    for (int node = 0; node < model.num_nodes(); ++node) {
      Eigen::Vector3d& position = model.positions[static_cast<std::size_t>(node)];
      const bool at_clamp = std::abs(position.x()) < 1e-9;
      const bool at_crown = std::abs(position.x() - length()) < 1e-9;
      const double above = position.z() - 0.5 * thickness;
      if (at_crown) crown.push_back(node);
      if (at_crown && std::abs(above) < 1e-9 && position.y() < 1e-9) scene.node = node;
      for (const int axis : {0, 1, 2}) {
        if (at_clamp || axis == 1 || (at_crown && axis == 0)) model.fixed.push_back({node, axis, 0.0});
      }
      const double angle = half_angle - position.x() / radius;  // from the crown
      position.x() = (radius + above) * -std::sin(angle);
      position.z() = (radius + above) * std::cos(angle);
    }
    scene.load = LoadCase::rest(model);
    spread_over_face(scene.load, model, crown, {0, 0, -1});
    return scene;
  }
};

// A thin strip clamped at one end and compressed along its axis. `aside` is the transverse part of the load.
struct Strip {
  double length = 20;
  double width = 1;
  double thickness = 0.2;
  double aside = 0.01;
  double young = 1;

  // The unit of force of the elastica, EI / L^2.
  double unit_force() const { return young * width * std::pow(thickness, 3) / 12 / (length * length); }

  // At load factor 1 the force is `force` units.
  PathScene scene(double force, int cells_along = 20) const {
    BlockShape shape;
    shape.cells = {cells_along, 1, 1};
    shape.size = {length, width, thickness};
    shape.law = neo_hookean_of(young, 0);
    PathScene scene;
    scene.model = with_middle_nodes(tetrahedral_block(shape));
    Model& model = scene.model;
    for (const int node : nodes_on_plane(model, 0, 0.0)) {
      for (const int axis : {0, 1, 2}) model.fixed.push_back({node, axis, 0.0});
    }
    scene.load = LoadCase::rest(model);
    const std::vector<int> tip = nodes_on_plane(model, 0, length);
    spread_over_face(scene.load, model, tip, force * unit_force() * Eigen::Vector3d(-1, 0, aside));
    for (const int node : tip) {
      const Eigen::Vector3d& at = model.positions[static_cast<std::size_t>(node)];
      if (at.y() == 0 && std::abs(at.z() - 0.5 * thickness) < 1e-9) scene.node = node;
    }
    return scene;
  }
};

}  // namespace palpate::test
