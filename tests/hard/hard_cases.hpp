// All hard cases, in groups.
#pragma once

#include <string>
#include <vector>

#include "tests/hard/hard_case.hpp"

namespace palpate::hard {

struct Group {
  std::string name;
  std::string title;
  std::string reading;  // the table's message, in a sentence or two
  std::vector<Case> cases;
};

Group large_strain_cases();
Group material_cases();
Group mesh_cases();
Group contact_cases();
Group slender_cases();
Group session_cases();
Group unsampled_cases();
Group unit_cases();
Group map_cases();
Group equilibrium_cases();
Group precision_cases();
// Runs the program at this path, as a user does.
Group program_cases();

std::vector<Group> all_groups();

}  // namespace palpate::hard
