// The methods of a pack that a report compares.
#pragma once

#include <cstdint>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"
#include "offline/study/report_rows.hpp"

namespace palpate {

// A response model of a pack, with the session settings that select the model.
struct ComparedMethod : MethodName {
  pal_model model = PAL_MODEL_LINEAR;
  std::uint32_t rings = 0;  // rings of elements of a nonlinear zone; 0: another model
};

// Returns all models of an open pack. The nonlinear zone appears once for each number of rings.
std::vector<ComparedMethod> carried_methods(const OpenedPack& opened);

}  // namespace palpate
