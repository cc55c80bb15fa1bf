// The numbers behind the plots, as CSV. Errors are parts, not percent; times are microseconds.
#pragma once

#include <string>

#include "offline/report/report_data.hpp"

namespace palpate {

// A row for each push and method: the same for the same pack and seed.
std::string pushes_csv(const OrganReport& organ);

// A row for each method and |d|: errors, and times where a method has them.
std::string methods_csv(const OrganReport& organ);

}  // namespace palpate
