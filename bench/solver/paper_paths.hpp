// Displacements of the cylinder of Zhong et al. 2005 section 2.4 under pushes and pulls, for each law.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <vector>

#include "bench/solver/small_newton.hpp"
#include "tests/support/paper_cylinder.hpp"

namespace palpate::test {

inline constexpr double kTiny = 0.01;  // a force whose response is linear to 1e-4
inline constexpr int kLargest = 80;    // the largest force of the paper's tables

// Displacements [num_dofs] under the forces sign * (kTiny, 1, 2, ..., kLargest), each reached from the last.
using Path = std::vector<Eigen::VectorXd>;
using Paths = std::map<int, Path>;  // by sign: -1 pushes, 1 pulls

inline double force_at(int sign, std::size_t index) {
  return sign * (index == 0 ? kTiny : static_cast<double>(index));
}

// Solves with StaticSolver.
Paths solved(const Law& law);
// Solves with SmallNewton, for laws that StaticSolver lacks.
Paths solved_by_small_newton(const SmallNewton::Response& response);

// Paths for lambda = `ratio` times the paper's.
struct LawPaths {
  Paths equation_1;
  Paths equation_11;       // kappa = lambda
  Paths matched;           // eq. (11) with the bulk modulus of eq. (1) at rest
  Paths without_coupling;  // eq. (11) + V
};
LawPaths solve_all(double ratio);

}  // namespace palpate::test
