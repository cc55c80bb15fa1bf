// The list of all groups.
#include "tests/hard/hard_cases.hpp"

namespace palpate::hard {

std::vector<Group> all_groups() {
  return {large_strain_cases(), material_cases(),    mesh_cases(),      contact_cases(),
          slender_cases(),      session_cases(),     unsampled_cases(), unit_cases(),
          map_cases(),          equilibrium_cases(), precision_cases(), program_cases()};
}

}  // namespace palpate::hard
