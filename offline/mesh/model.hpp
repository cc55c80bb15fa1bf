// The checked finite element model: what a model file means, with every name resolved to an index.
//
// A Model is only ever made by a reader (inp_reader.hpp) that has checked it: every node an element names
// exists, every element has a positive volume and a material, every set is known, every free part is held.
// Everything behind the readers may rely on that.
#pragma once

#include <Eigen/Core>
#include <array>
#include <compare>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "offline/material/law.hpp"

namespace palpate {

// Where a thing was said, for messages: "liver.inp:214".
struct SourceLine {
  std::string file;
  int line = 0;
};

struct Material {
  std::string name;
  Law law;
  double density = 0;  // mass unit / length unit^3; 0 = none given
};

// A tetrahedron of four nodes (C3D4) or of ten (C3D10: the corners, then the middles of the edges 01 12 02 03
// 13 23). It is upright: (x1-x0) . ((x2-x0) x (x3-x0)) > 0, and so is the map of ten nodes at its integration
// points.
struct Tetrahedron {
  int label = 0;
  int material = 0;  // index in Model::materials
  int num_nodes = 4;
  std::array<int, 10> node_array = {};  // indices in Model::positions, num_nodes of them
  // Elements of the same number share their volume change (volume_patches.hpp); -1: each point has its own.
  int volume_patch = -1;

  std::span<const int> nodes() const { return {node_array.data(), static_cast<std::size_t>(num_nodes)}; }
  std::span<int> nodes() { return {node_array.data(), static_cast<std::size_t>(num_nodes)}; }
  std::span<const int, 4> corners() const { return std::span<const int, 10>(node_array).first<4>(); }
};

// The factor of a load over time (*AMPLITUDE): linear between its points, constant outside them.
struct Amplitude {
  std::string name;
  bool total_time = false;                    // time since the first step began, not since this one did
  std::vector<std::array<double, 2>> points;  // (time, factor), times ascending; at least one

  double at(double time) const;
};

// Amplitude of a load that has none: within its step it ramps linearly from what it was at the end of the
// step before.
constexpr int kRamp = -1;

// One degree of freedom held at a value (length unit).
struct PrescribedDisplacement {
  int node = 0;
  int axis = 0;  // 0, 1, 2 = x, y, z
  double value = 0;
  int amplitude = kRamp;  // index in Model::amplitudes, here and below
};

// A concentrated force (force unit).
struct NodalForce {
  int node = 0;
  int axis = 0;
  double value = 0;
  int amplitude = kRamp;
};

// A face of an element: face 0 .. 3 is P1 .. P4 or S1 .. S4 in Abaqus, see outward_face().
struct FaceId {
  int element = 0;
  int face = 0;
  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy sees a 0 in the default
  friend auto operator<=>(const FaceId&, const FaceId&) = default;
};

// A pressure that pushes into the element, along the normal and over the area that the face has when the step
// is NLGEOM, or had at rest (force unit / length unit^2).
struct FacePressure {
  FaceId face;
  double value = 0;
  int amplitude = kRamp;
};

// A force per area at rest that keeps its direction: the averaged traction of Zhong et al. 2005 eq. (7)
// (force unit / length unit^2).
struct FaceTraction {
  FaceId face;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  int amplitude = kRamp;
};

// An acceleration that pulls at the mass of an element (length unit / time unit^2).
struct Gravity {
  int element = 0;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  int amplitude = kRamp;
};

// What *STATIC, RIKS says beyond its increments, which are of arc length over the total of the data line: both
// are a load factor while the body answers linearly.
struct ArcLengthControl {
  std::optional<double> end_load_factor;  // above 0; the step ends there
  int node = -1;                          // monitored, or -1
  int axis = 0;
  std::optional<double> end_displacement;  // of that node along that axis; the step ends there
  std::vector<int> watched;                // the nodes of the sets of *NODE PRINT and *NODE FILE, sorted
};

// One *STEP, with everything that acts in it: what earlier steps prescribed and this one neither replaces nor
// removes is in it too. Every list is sorted by where its loads act.
struct Step {
  double start_time = 0;         // total time at its begin
  double period = 1;             // time it lasts, from the *STATIC data line; 1 with RIKS
  int max_increments = 100;      // *STEP, INC=
  double first_increment = 1.0;  // fraction of the step, from the *STATIC data line
  double smallest_increment = 1e-5;
  double largest_increment = 1.0;  // never below first_increment; with RIKS it may be infinite
  std::optional<ArcLengthControl> riks;
  std::vector<PrescribedDisplacement>
      prescribed;                  // unique; Model::fixed is in it at zero, unless a step moves or
                                   // releases it
  std::vector<NodalForce> forces;  // those at one place add up, here and below
  std::vector<FacePressure> pressures;
  std::vector<FaceTraction> tractions;
  std::vector<Gravity> gravity;
  SourceLine source;
};

struct Model {
  std::string heading;
  std::string file;
  std::vector<std::string> files;          // every file it was read from: `file` first, then what it includes
  std::vector<int> labels;                 // node label of each node, in the order of the file
  std::vector<Eigen::Vector3d> positions;  // reference configuration, length unit
  std::vector<Tetrahedron> elements;
  std::vector<Material> materials;
  std::map<std::string, std::vector<int>> node_sets;     // upper-case name -> sorted node indices
  std::map<std::string, std::vector<int>> element_sets;  // upper-case name -> sorted element indices
  std::vector<PrescribedDisplacement>
      fixed;  // the homogeneous *BOUNDARY before the first *STEP, sorted by (node, axis)
  std::vector<Amplitude> amplitudes;
  std::vector<Step> steps;
  std::vector<std::string> warnings;  // e.g. output requests that were passed over, "file:line: ..."

  int num_nodes() const { return static_cast<int>(positions.size()); }
  int num_dofs() const { return 3 * num_nodes(); }

  // Whether the steps are without NLGEOM: loads then act on the body at rest, whatever its displacement.
  bool small_strain() const;

  // For each degree of freedom (num_dofs) and each node (num_nodes), whether `fixed` holds it, or any of it.
  std::vector<char> fixed_dofs() const;
  std::vector<char> fixed_nodes() const;

  // Index of the node with this label, or -1. Cost: O(log nodes).
  int find_node(int label) const;

  std::vector<std::pair<int, int>> label_index;  // (label, node index), sorted by label; see find_node
};

}  // namespace palpate
