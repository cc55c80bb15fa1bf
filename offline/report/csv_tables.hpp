// Writes the numbers behind the plots as CSV. Errors are fractions, not percent; times are microseconds.
#pragma once

#include <string>

#include "offline/report/report_data.hpp"

namespace palpate {

// Returns a row for each push and method. Equal pack and seed give equal text.
std::string pushes_csv(const OrganReport& organ);

// Returns a row for each method and |d|: errors, and measured times.
std::string methods_csv(const OrganReport& organ);

}  // namespace palpate
