// Writes the numbers behind the plots as CSV. Errors are fractions, not percent; times are microseconds.
#pragma once

#include <string>

#include "offline/report/report_data.hpp"

namespace palpate {

// A row for each push and method; equal pack and seed give equal text.
std::string pushes_csv(const OrganReport& organ);

// A row for each method and |d|: errors, and measured times.
std::string methods_csv(const OrganReport& organ);

}  // namespace palpate
