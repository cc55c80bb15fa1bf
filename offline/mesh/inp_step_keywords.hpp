// The keywords that say when things are done to the body: *STEP, *STATIC, *END STEP.
#pragma once

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

// Each reads its data lines from the lexer and notes what they say in the draft. InputError on the first
// mistake.
void read_step(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_static(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_end_step(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);

}  // namespace palpate
