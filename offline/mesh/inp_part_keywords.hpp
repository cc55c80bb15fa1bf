// Reads *PART, *ASSEMBLY, *INSTANCE and their ends into one flat model.
//
//   *PART, NAME=LIVER             the mesh of a part, at rest in its own axes
//   ...
//   *END PART
//   *ASSEMBLY, NAME=ALL
//   *INSTANCE, NAME=LIVER-1, PART=LIVER
//   0, 0, 40                      <- shift
//   0, 0, 0, 0, 0, 1, 90          <- then a turn about the axis from the first to the second point, degrees
//   *END INSTANCE
//   *NSET, NSET=BASE, INSTANCE=LIVER-1
//   *END ASSEMBLY
//
// An instance is a copy of its part. Its sets and surfaces are called LIVER-1.NAME, and NAME where the name
// is unique. Labels of the first instance stay; an offset shifts the labels of others behind all labels
// before.
#pragma once

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

// Each function reads its data lines from the lexer into the draft. Throws InputError on the first mistake.
// The level of the draft changes also where the function throws, so that the reading can go on.
void read_part(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_end_part(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_assembly(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_instance(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_end_instance(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);
void read_end_assembly(InpLexer& lexer, const KeywordLine& keyword, Draft& draft);

// The warning about shifted labels, or "" where none is shifted.
std::string shifted_labels_warning(const Draft& draft);

}  // namespace palpate
