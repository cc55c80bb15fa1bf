// Reads and resolves *TIE of surfaces whose nodes lie at the same places: the two bodies get common nodes,
// which is the same constraint.
#pragma once

#include <utility>
#include <vector>

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

// Reads the data lines (slave surface, master surface) into the draft. Throws InputError on the first
// mistake.
void read_tie(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);

// Replaces each node of a slave surface by the node of the master surface at its place, in the elements, sets
// and labels of `model`, whose node and element sets are resolved. Throws InputError where a node has no such
// partner or several. `element_index`: (label, index), sorted. Cost: O(n log n) in the faces.
void join_ties(const Draft& draft, const SourceFiles& files,
               const std::vector<std::pair<int, int>>& element_index, Model& model);

}  // namespace palpate
