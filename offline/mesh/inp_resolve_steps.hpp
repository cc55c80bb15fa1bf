// Resolves the steps of a draft: supports and loads of the body in each step.
#pragma once

#include <utility>
#include <vector>

#include "offline/mesh/inp_draft.hpp"

namespace palpate {

// Sets Model::fixed, amplitudes and steps; the rest of `model` is resolved already. `element_index`: (label,
// index), sorted. Throws InputError.
void resolve_steps(const Draft& draft, const SourceFiles& files,
                   const std::vector<std::pair<int, int>>& element_index, Model& model);

}  // namespace palpate
