// Dense decompositions. Eigen's are templates that take a compiler several seconds in each file; these are compiled once.
#pragma once

#include <Eigen/Core>

namespace palpate {

struct SymmetricModes {
  Eigen::VectorXd values;   // eigenvalues, rising
  Eigen::MatrixXd vectors;  // a unit eigenvector a column, in the order of values
};

// Reads the lower triangle.
[[nodiscard]] SymmetricModes symmetric_modes(const Eigen::MatrixXd& symmetric);

// Returns A^-1 B of a symmetric positive definite A. Does not say whether A is one.
[[nodiscard]] Eigen::MatrixXd solve_definite(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

// Returns the shortest X of those with the least |A X - B|.
[[nodiscard]] Eigen::MatrixXd least_squares(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

}  // namespace palpate
