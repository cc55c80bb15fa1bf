// The methods of a pack that a report compares.
#pragma once

#include <cstdint>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"
#include "offline/study/report_rows.hpp"

namespace palpate {

// A model of a pack as a session evaluates it.
struct ComparedMethod : MethodName {
  pal_model model = PAL_MODEL_LINEAR;
  std::uint32_t rings = 0;  // rings of a zone
};

// Returns all models of an open pack, and a zone for each number of its rings.
std::vector<ComparedMethod> carried_methods(const OpenedPack& opened);

}  // namespace palpate
