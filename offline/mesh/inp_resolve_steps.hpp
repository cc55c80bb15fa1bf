// The steps of a draft with their labels looked up: what holds and loads the body at each of them.
#pragma once

#include <utility>
#include <vector>

#include "offline/mesh/inp_draft.hpp"

namespace palpate {

// Sets Model::fixed, amplitudes and steps; all else of `model` is resolved already. `element_index`: (label,
// index), sorted. Throws InputError.
void resolve_steps(const Draft& draft, const SourceFiles& files,
                   const std::vector<std::pair<int, int>>& element_index, Model& model);

}  // namespace palpate
