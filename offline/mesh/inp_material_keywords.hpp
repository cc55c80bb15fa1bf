// Reads the keywords of materials: *MATERIAL, *DENSITY, *HYPERELASTIC, *ELASTIC, *SOLID SECTION.
#pragma once

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

// Each function reads its data lines from the lexer into the draft. Throws InputError on the first mistake.
// Density and laws belong to the last *MATERIAL.
void read_material(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_density(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_hyperelastic(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_elastic(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_solid_section(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);

}  // namespace palpate
