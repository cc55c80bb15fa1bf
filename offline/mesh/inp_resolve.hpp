// Turns the draft of an .inp file into a Model: resolves labels to indices, carries steps over, checks the model.
#pragma once

#include <string>

#include "offline/mesh/inp_draft.hpp"

namespace palpate {

// `file` names the model file in messages. Throws InputError. Cost: O(n log n) in nodes and elements.
Model resolve(const Draft& draft, const SourceFiles& files, const std::string& file);

}  // namespace palpate
