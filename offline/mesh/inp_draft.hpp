// The content of an .inp file before label look-up. Elements may name nodes that follow later, so keywords
// only record their data. inp_resolve.hpp turns the draft into a Model.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "offline/mesh/source_place.hpp"

namespace palpate {

// One entry of a set: the labels first, first + step, ... up to last.
struct LabelRange {
  int first = 0;
  int last = 0;
  int step = 1;
  Place place;
};

struct DraftSet {
  std::string name;  // normalised
  std::vector<LabelRange> ranges;
};

// The node sets or the element sets of a model, in order of first mention.
class DraftSets {
 public:
  // Returns the index of the set; adds a new set.
  int add(const std::string& name) {
    const auto [found, is_new] = index_.try_emplace(name, static_cast<int>(sets_.size()));
    if (is_new) sets_.push_back({name, {}});
    return found->second;
  }
  // Returns the index of the set, or -1.
  int find(const std::string& name) const {
    const auto found = index_.find(name);
    return found == index_.end() ? -1 : found->second;
  }
  DraftSet& operator[](int set) { return sets_[static_cast<std::size_t>(set)]; }
  const std::vector<DraftSet>& all() const { return sets_; }
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const DraftSet& set : sets_) names.push_back(set.name);
    return names;
  }

 private:
  std::vector<DraftSet> sets_;
  std::map<std::string, int> index_;
};

struct DraftNode {
  int label = 0;
  Place place;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

struct DraftElement {
  int label = 0;
  Place place;
  int num_nodes = 4;
  bool hybrid = false;  // C3D10H
  std::array<int, 10> node_labels = {};
};

// An element of a line or a surface. It carries nothing, unless a section, load or surface refers to it.
struct DraftDropped {
  int label = 0;
  const char* type = "";  // a literal, such as "CPS3"
  Place place;
};

struct DraftMaterial {
  Material material;
  bool has_law = false;
  Place place;
};

struct DraftSection {
  int element_set = 0;
  std::string material;
  bool mean_dilatation = false;
  Place place;
};

// A node or element by label, or all members of a set.
struct DraftTarget {
  int label = 0;
  int set = -1;  // valid unless -1
};

// Faces 0 .. 3 as in outward_face(); kOuterFaces: every face without a neighbour.
constexpr int kOuterFaces = -1;

struct DraftFaces {
  DraftTarget elements;
  int face = kOuterFaces;
  Place place;
};

struct DraftSurfaceNodes {
  DraftTarget nodes;
  Place place;
};

struct DraftSurface {
  std::string name;
  std::vector<DraftFaces> faces;
  bool of_nodes = false;  // TYPE=NODE: has nodes instead of faces
  std::vector<DraftSurfaceNodes> nodes;
};

// The nodes of the slave become the nodes of the master at their places. Indices in DraftMesh::surfaces.
struct DraftTie {
  int slave = 0;
  int master = 0;
  Place place;
};

struct DraftDisplacement {
  DraftTarget target;
  int first_axis = 0;
  int last_axis = 0;
  double value = 0;
  int amplitude = kRamp;
  bool keeps = false;  // FIXED: the value at the end of the step before; `value` has no meaning
  Place place;
};

struct DraftForce {
  DraftTarget target;
  int axis = 0;
  double value = 0;
  int amplitude = kRamp;
  Place place;
};

struct DraftGravity {
  DraftTarget elements;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  int amplitude = kRamp;
  Place place;
};

// A pressure or traction: on the faces of a *DLOAD line, or on a *DSLOAD surface.
template <typename Value>
struct DraftFaceLoad {
  DraftFaces faces;  // for *DLOAD
  int surface = -1;  // for *DSLOAD: index in Draft::surfaces, valid unless -1
  Value value;
  int amplitude = kRamp;
  Place place;
};

// OP= of the first line of a keyword decides for the whole step: NEW removes the keyword's values of earlier
// steps, MOD (default) keeps them.
struct DraftOp {
  bool given = false;
  bool is_new = false;
};

// The monitored node of *STATIC, RIKS and the sets of watched nodes, each with its line.
struct DraftRiks {
  ArcLengthControl control;  // its node indices are not resolved yet
  int node_label = 0;        // 0 = none
  struct Watched {
    int set = 0;
    Place place;
  };
  std::vector<Watched> watched;
  Place place;       // place of *STATIC
  Place data_place;  // place of its data line
};

struct DraftStep {
  Step step;  // time and increments only
  bool nlgeom = false;
  bool has_static = false;
  std::optional<DraftRiks> riks;
  bool ended = false;
  std::vector<DraftDisplacement> prescribed;
  std::vector<DraftForce> forces;
  std::vector<DraftGravity> gravity;
  std::vector<DraftFaceLoad<double>> pressures;
  std::vector<DraftFaceLoad<Eigen::Vector3d>> tractions;
  DraftOp boundary_op;
  DraftOp cload_op;
  DraftOp dload_op;
  DraftOp dsload_op;
  Place place;
};

// What a part may hold.
struct DraftMesh {
  std::vector<DraftNode> nodes;
  std::vector<DraftElement> elements;
  std::vector<DraftDropped> dropped;
  DraftSets node_sets;
  DraftSets element_sets;
  std::vector<DraftSection> sections;
  std::vector<DraftSurface> surfaces;
};

// The pose of an instance: x -> turn (x + shift - centre) + centre.
struct DraftPose {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
};

// The parts and instances of an assembly (inp_part_keywords.hpp).
struct DraftAssembly {
  enum class Level { model, part, assembly, instance };
  Level level = Level::model;
  std::string keyword;            // that opened the level, for messages
  Place place;                    // its place
  std::string name;               // of the open part or instance
  std::optional<DraftPose> pose;  // of the open instance; none: it is at rest
  DraftMesh outer;                // the mesh around the open part or instance
  std::map<std::string, DraftMesh> parts;
  std::map<std::string, int> label_offsets;  // by instance
  int largest_label = 0;                     // of nodes and elements of the instances
  std::size_t num_copied = 0;                // items of all instances
  std::vector<std::string> shifted;          // instances with an offset, for a warning
  // Names of sets and surfaces within instances: how many instances have the name, and one of their indices.
  using Names = std::map<std::string, std::pair<int, int>>;
  Names node_sets;
  Names element_sets;
  Names surfaces;

  bool in_part() const { return level == Level::part || level == Level::instance; }
};

// Inside of *PART and *INSTANCE, the mesh is the mesh of that part or instance.
struct Draft : DraftMesh {
  bool keeps_mesh = true;  // false: nodes, elements and members of sets are checked and not kept
  std::vector<DraftMaterial> materials;
  std::vector<Amplitude> amplitudes;
  std::vector<DraftTie> ties;
  std::vector<DraftDisplacement> fixed;
  std::vector<DraftStep> steps;
  DraftAssembly assembly;
  std::vector<std::string> warnings;
  std::vector<std::pair<std::string, int>> passed_over;  // what changes no result, with its count
  int num_short_nodes = 0;                               // *NODE lines with fewer than three coordinates
  bool has_modified = false;                             // C3D10M

  bool in_step() const { return !steps.empty() && !steps.back().ended; }

  void pass_over(const std::string& what) {
    const auto known = std::find_if(passed_over.begin(), passed_over.end(),
                                    [&](const auto& counted) { return counted.first == what; });
    constexpr std::size_t kMost = 64;  // bounds the warning, however the names are spelled
    if (known != passed_over.end()) {
      ++known->second;
    } else if (passed_over.size() < kMost) {
      passed_over.emplace_back(what, 1);
    }
  }
};

}  // namespace palpate
