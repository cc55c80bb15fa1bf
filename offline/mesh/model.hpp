// The checked finite element model: a model file with every name resolved to an index.
//
// Only a checking reader makes a Model (inp_reader.hpp). Later stages rely on its guarantees:
//   1. every node of an element and every set exists,
//   2. every element has a positive volume and a material,
//   3. every part is held against rigid motion.
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

// A place in the input, for messages: "liver.inp:214".
struct SourceLine {
  std::string file;
  int line = 0;
};

struct Material {
  std::string name;
  Law law;
  double density = 0;  // mass unit / length unit^3; 0 = not given
};

// A tetrahedron with four nodes (C3D4) or ten (C3D10: the corners, then the middles of the edges 01 12 02 03
// 13 23). Its map has det F > 0: (x1-x0) . ((x2-x0) x (x3-x0)) > 0, for ten nodes at every integration point.
struct Tetrahedron {
  int label = 0;
  int material = 0;  // index in Model::materials
  int num_nodes = 4;
  std::array<int, 10> node_array = {};  // indices in Model::positions, num_nodes of them
  // Elements with equal numbers share their volume change (volume_patches.hpp); -1: each point has its own.
  int volume_patch = -1;

  std::span<const int> nodes() const { return {node_array.data(), static_cast<std::size_t>(num_nodes)}; }
  std::span<int> nodes() { return {node_array.data(), static_cast<std::size_t>(num_nodes)}; }
  std::span<const int, 4> corners() const { return std::span<const int, 10>(node_array).first<4>(); }
};

// The factor of a load over time (*AMPLITUDE): linear between its points, constant outside of them.
struct Amplitude {
  std::string name;
  bool total_time = false;                    // true: time since the first step; false: since this step
  std::vector<std::array<double, 2>> points;  // (time, factor), times ascending; at least one

  double at(double time) const;
};

// Amplitude of a load without *AMPLITUDE: a linear ramp from the value at the end of the step before.
constexpr int kRamp = -1;

// One degree of freedom held at a value (length unit).
struct PrescribedDisplacement {
  int node = 0;
  int axis = 0;  // 0, 1, 2 = x, y, z
  double value = 0;
  int amplitude = kRamp;  // index in Model::amplitudes, in all loads
};

// A concentrated force (force unit).
struct NodalForce {
  int node = 0;
  int axis = 0;
  double value = 0;
  int amplitude = kRamp;
};

// Face 0 .. 3 of an element, in Abaqus P1 .. P4 or S1 .. S4; see outward_face().
struct FaceId {
  int element = 0;
  int face = 0;
  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy sees a 0 in the default
  friend auto operator<=>(const FaceId&, const FaceId&) = default;
};

// A pressure into the element (force unit / length unit^2). With NLGEOM the pressure acts on the current
// normal and area, else on the normal and area at rest.
struct FacePressure {
  FaceId face;
  double value = 0;
  int amplitude = kRamp;
};

// A force per area at rest with constant direction, force unit / length unit^2: Zhong et al. 2005 eq. (7).
struct FaceTraction {
  FaceId face;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  int amplitude = kRamp;
};

// An acceleration of an element's mass (length unit / time unit^2).
struct Gravity {
  int element = 0;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  int amplitude = kRamp;
};

// *STATIC, RIKS beyond its increments. Increments are fractions of the total arc length, equal to a load
// factor for a linear body.
struct ArcLengthControl {
  std::optional<double> end_load_factor;  // above 0; end of the step
  int node = -1;                          // monitored, or -1
  int axis = 0;
  std::optional<double> end_displacement;  // displacement of `node` along `axis` that ends the step
  std::vector<int> watched;                // nodes of the sets of *NODE PRINT and *NODE FILE, sorted
};

// One *STEP with all its loads, including loads of earlier steps that it neither replaces nor removes. Every
// list is sorted by place.
struct Step {
  double start_time = 0;         // total time at the start
  double period = 1;             // duration, from the *STATIC data line; 1 with RIKS
  int max_increments = 100;      // *STEP, INC=
  double first_increment = 1.0;  // fraction of the step, from the *STATIC data line
  double smallest_increment = 1e-5;
  double largest_increment = 1.0;  // at least first_increment; with RIKS possibly infinite
  std::optional<ArcLengthControl> riks;
  // Each dof once. Contains the dofs of Model::fixed at zero, unless a step moves or releases them.
  std::vector<PrescribedDisplacement> prescribed;
  std::vector<NodalForce> forces;  // forces at one place add up, in all lists
  std::vector<FacePressure> pressures;
  std::vector<FaceTraction> tractions;
  std::vector<Gravity> gravity;
  SourceLine source;
};

struct Model {
  std::string file;
  std::vector<std::string> files;          // `file` first, then its includes
  std::vector<int> labels;                 // node label of each node, in the order of the file
  std::vector<Eigen::Vector3d> positions;  // reference configuration, length unit
  double merge_length = 0;                 // nodes closer than this are merged (merge_nodes.hpp); 0 = none
  std::vector<Tetrahedron> elements;
  std::vector<Material> materials;
  std::map<std::string, std::vector<int>> node_sets;     // upper-case name -> sorted node indices
  std::map<std::string, std::vector<int>> element_sets;  // upper-case name -> sorted element indices
  // Homogeneous *BOUNDARY before the first *STEP, sorted by (node, axis).
  std::vector<PrescribedDisplacement> fixed;
  std::vector<Amplitude> amplitudes;
  std::vector<Step> steps;
  std::vector<std::string> warnings;  // "file:line: ...", such as skipped output requests

  int num_nodes() const { return static_cast<int>(positions.size()); }
  int num_dofs() const { return 3 * num_nodes(); }

  // Whether a law is LinearElastic. No step then has NLGEOM, and loads act on the body at rest.
  bool small_strain() const;

  // For each dof (num_dofs) and each node (num_nodes): whether `fixed` holds the dof, or any dof of the node.
  std::vector<char> fixed_dofs() const;
  std::vector<char> fixed_nodes() const;

  // Returns the index of the node with this label, or -1. Cost: O(log nodes).
  int find_node(int label) const;

  std::vector<std::pair<int, int>> label_index;  // (label, node index), sorted by label
};

}  // namespace palpate
