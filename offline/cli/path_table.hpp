// Collects path.csv of *STATIC, RIKS: the load factor along the path, and the displacements of a few nodes.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "offline/fem/arc_length.hpp"
#include "offline/mesh/model.hpp"

namespace palpate {

class PathTable {
 public:
  // Chooses the watched nodes, by the first rule that applies:
  //   1. the sets of the step's *NODE PRINT and *NODE FILE,
  //   2. the monitored node,
  //   3. the node with the largest displacement at the first point behind the start.
  // The table keeps a reference to `model`.
  PathTable(const Model& model, const ArcLengthControl& control);

  // Adds a point. The first point is the start of the path.
  void add(const PathPoint& point, const Eigen::VectorXd& displacement);

  // Writes CSV: increment,arc_length,load_factor,current_stiffness,negative_pivots,min_J, then
  // ux_NODE,uy_NODE,uz_NODE for each node by its label; 12 significant digits.
  void write(const std::filesystem::path& file) const;

 private:
  struct Row {
    PathPoint point;
    std::vector<Eigen::Vector3d> displacements;  // one for each of nodes_
  };
  void add_row(const PathPoint& point, const Eigen::VectorXd& displacement);

  const Model* model_;
  std::vector<int> nodes_;  // the watched nodes; empty until rule 3 applies
  PathPoint start_;         // kept until the nodes are chosen
  Eigen::VectorXd start_displacement_;
  std::vector<Row> rows_;
};

}  // namespace palpate
