// Turns the draft of an .inp file into a checked Model: resolves labels and carries loads over steps.
#pragma once

#include <string>

#include "offline/mesh/inp_draft.hpp"

namespace palpate {

// `file` names the model file in messages. `merge_length`: as in read_inp(). Throws InputError. Cost:
// O(n log n) in nodes and elements.
Model resolve(const Draft& draft, const SourceFiles& files, const std::string& file, double merge_length);

// Resolves everything that the file has. Elements without a section get the material -1. The mesh and its
// supports are not checked.
Model resolve_unchecked(const Draft& draft, const SourceFiles& files, const std::string& file,
                        double merge_length);

// Returns nodes, elements and sets alone, as read: nothing is checked beyond labels.
Model resolve_mesh(const Draft& draft, const SourceFiles& files, const std::string& file);

}  // namespace palpate
