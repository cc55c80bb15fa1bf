// The keywords that describe the mesh: *NODE, *ELEMENT, *NSET, *ELSET, *SURFACE.
#pragma once

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

// Each reads its data lines from the lexer and notes what they say in the draft. InputError on the first
// mistake.
void read_nodes(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_elements(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_node_set(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_element_set(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_surface(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);

}  // namespace palpate
