// Reads *ELEMENT: tetrahedra, and elements of lines and surfaces that meshers write along.
#pragma once

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

// Reads the data lines from the lexer into the draft. Throws InputError on the first mistake, and for
// elements that are neither tetrahedra nor elements of lines and surfaces.
void read_elements(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);

}  // namespace palpate
