// Reads the keywords of the mesh: *NODE, *NSET, *ELSET, *SURFACE.
#pragma once

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

// Each function reads its data lines from the lexer into the draft. Throws InputError on the first mistake.
void read_nodes(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_node_set(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_element_set(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_surface(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);

}  // namespace palpate
