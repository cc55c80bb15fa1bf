// Keywords that change no result of a static solve: requests for output, controls of another solver, and
// values of zero. One warning names all of them.
#pragma once

#include <initializer_list>
#include <string_view>

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

// Passes over a keyword with any parameters and data lines.
void pass_over(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);

// Passes over *RESTART and *INITIAL CONDITIONS unless they change the state at rest. Throws InputError then.
void read_restart(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_initial_conditions(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);

// Refuses parameters of `keyword` outside of `known` and `harmless`, and passes over the latter.
void allow_parameters(const InpLexer& lexer, const KeywordLine& keyword, Draft& draft,
                      std::initializer_list<std::string_view> known,
                      std::initializer_list<std::string_view> harmless);

// The warning, or "" where nothing was passed over.
std::string passed_over_warning(const Draft& draft);

}  // namespace palpate
