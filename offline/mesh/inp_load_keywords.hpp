// Reads the keywords of loads and supports: *AMPLITUDE, *BOUNDARY, *CLOAD, *DLOAD, *DSLOAD.
#pragma once

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

// Each function reads its data lines from the lexer into the draft. Throws InputError on the first mistake.
void read_amplitude(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_boundary(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_cload(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_dload(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_dsload(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);

}  // namespace palpate
