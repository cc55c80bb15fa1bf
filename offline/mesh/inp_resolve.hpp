// From what an .inp file says to a Model: labels become indices, steps carry over, the model is checked.
#pragma once

#include <string>

#include "offline/mesh/inp_draft.hpp"

namespace palpate {

// `file` is the name of the model file in messages. Throws InputError. Cost: O(n log n) in nodes and
// elements.
Model resolve(const Draft& draft, const SourceFiles& files, const std::string& file);

}  // namespace palpate
