// Explains to the user why a step of `solve` did not converge.
#pragma once

#include <cstddef>

#include "offline/fem/static_solver.hpp"

namespace palpate {

// Prints the last rows of the residual table and one line to standard error. The line states the last
// converged load factor, the cause and the remedy. `step` counts from 1.
void print_failure(const SolveReport& report, std::size_t step, const Model& model);

}  // namespace palpate
