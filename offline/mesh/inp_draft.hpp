// What an .inp file says, before its labels are looked up: Abaqus lets an element name nodes that come later
// in the file, so keywords only note what they read, and inp_resolve.hpp turns the draft into a Model.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "offline/mesh/source_place.hpp"

namespace palpate {

// The labels first, first + step, ... up to last: one entry of a set.
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

// The node sets of a model, or its element sets, in the order in which they were first named.
class DraftSets {
 public:
  // Index of the set, made when it is new.
  int add(const std::string& name) {
    const auto [found, is_new] = index_.try_emplace(name, static_cast<int>(sets_.size()));
    if (is_new) sets_.push_back({name, {}});
    return found->second;
  }
  // Index of the set, or -1.
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

// A node or element by its label, or every one of a set.
struct DraftTarget {
  int label = 0;
  int set = -1;  // used when it is not -1
};

// Faces 0 .. 3 as in outward_face(), or every face that no other element shares.
constexpr int kOuterFaces = -1;

struct DraftFaces {
  DraftTarget elements;
  int face = kOuterFaces;
  Place place;
};

struct DraftSurface {
  std::string name;
  std::vector<DraftFaces> faces;
};

struct DraftDisplacement {
  DraftTarget target;
  int first_axis = 0;
  int last_axis = 0;
  double value = 0;
  int amplitude = kRamp;
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

// A pressure or traction on the faces of one line of *DLOAD, or on a surface (*DSLOAD).
template <typename Value>
struct DraftFaceLoad {
  DraftFaces faces;  // of *DLOAD
  int surface = -1;  // of *DSLOAD: index in Draft::surfaces, used when it is not -1
  Value value;
  int amplitude = kRamp;
  Place place;
};

// What OP= of the first line of a keyword in a step says for the whole step: whether what earlier steps gave
// by this keyword goes (NEW) or stays (MOD, the default).
struct DraftOp {
  bool given = false;
  bool is_new = false;
};

// The node that *STATIC, RIKS names and the sets whose nodes are watched, each with its line.
struct DraftRiks {
  ArcLengthControl control;  // without nodes
  int node_label = 0;        // 0 = none
  struct Watched {
    int set = 0;
    Place place;
  };
  std::vector<Watched> watched;
  Place place;       // of *STATIC
  Place data_place;  // of its data line
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

struct Draft {
  std::string heading;
  std::vector<DraftNode> nodes;
  std::vector<DraftElement> elements;
  DraftSets node_sets;
  DraftSets element_sets;
  std::vector<DraftMaterial> materials;
  std::vector<DraftSection> sections;
  std::vector<DraftSurface> surfaces;
  std::vector<Amplitude> amplitudes;
  std::vector<DraftDisplacement> fixed;
  std::vector<DraftStep> steps;
  std::vector<std::string> warnings;

  bool in_step() const { return !steps.empty() && !steps.back().ended; }
};

}  // namespace palpate
