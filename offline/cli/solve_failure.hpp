// What `solve` says of a step that did not converge.
#pragma once

#include <cstddef>

#include "offline/fem/static_solver.hpp"

namespace palpate {

// Prints the end of the residual table and one line with the last converged load factor, the cause and what to
// do about it, on standard error. `step` counts from 1.
void print_failure(const SolveReport& report, std::size_t step, const Model& model);

}  // namespace palpate
