// The keywords that say what is done to the body: *AMPLITUDE, *BOUNDARY, *CLOAD, *DLOAD, *DSLOAD.
#pragma once

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

// Each reads its data lines from the lexer and notes what they say in the draft. InputError on the first
// mistake.
void read_amplitude(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_boundary(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_cload(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_dload(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_dsload(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);

}  // namespace palpate
