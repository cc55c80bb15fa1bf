// Writes and reads the nodal tables of `solve` and `eval`.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

// A node of a table, in model units.
struct NodalRow {
  int label = 0;                                       // of the model file
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // in the mesh
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> force;  // that the outside applies; empty: unknown
};

std::vector<NodalRow> nodal_rows(const Model& model, const Eigen::VectorXd& displacement,
                                 const Eigen::VectorXd& force);

// Writes CSV: node,x,y,z,ux,uy,uz,fx,fy,fz with a header and 12 significant digits. Unknown forces are empty.
void write_nodal_table(const std::filesystem::path& file, const std::vector<NodalRow>& rows);

// Reads such a table of finite numbers. Throws InputError with file and line.
std::vector<NodalRow> read_nodal_table(const std::filesystem::path& file);

}  // namespace palpate
