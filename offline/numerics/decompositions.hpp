// Dense decompositions, compiled once: Eigen's templates cost each file seconds of compile time.
#pragma once

#include <Eigen/Core>

namespace palpate {

struct SymmetricModes {
  Eigen::VectorXd values;   // eigenvalues, ascending
  Eigen::MatrixXd vectors;  // unit eigenvectors as columns, in the order of `values`
};

// Returns all eigenvalues and eigenvectors. Reads the lower triangle only.
[[nodiscard]] SymmetricModes symmetric_modes(const Eigen::MatrixXd& symmetric);

// Returns A^-1 B. Requires a symmetric positive definite A and does not check this.
[[nodiscard]] Eigen::MatrixXd solve_definite(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

// Returns the X of least norm among all X that minimise |A X - B|.
[[nodiscard]] Eigen::MatrixXd least_squares(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

}  // namespace palpate
