// Reads the keywords of steps: *STEP, *STATIC, *END STEP.
#pragma once

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

// Each function reads its data lines from the lexer into the draft. Throws InputError on the first mistake.
void read_step(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_static(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_end_step(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);

}  // namespace palpate
