// Writes and reads the nodal tables of `solve` and `eval`.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

// One row: node label, reference position, displacement, and the force that the outside applies (absent: unknown).
struct NodalRow {
  int label = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> force;
};

std::vector<NodalRow> nodal_rows(const Model& model, const Eigen::VectorXd& displacement,
                                 const Eigen::VectorXd& force);

// Writes CSV with the header node,x,y,z,ux,uy,uz,fx,fy,fz and 12 significant digits. Unknown forces stay empty.
void write_nodal_table(const std::filesystem::path& file, const std::vector<NodalRow>& rows);

// Reads a nodal table: 10 fields a row, finite numbers, forces given or empty. Throws InputError with file and line.
std::vector<NodalRow> read_nodal_table(const std::filesystem::path& file);

}  // namespace palpate
