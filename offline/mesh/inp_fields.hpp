// Reads the fields of a data line as numbers and names; a wrong field gives a message.
#pragma once

#include <string>

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

class FieldReader {
 public:
  // Refuses a line with fewer than `least` or more than `most` fields: "expected `layout`, found 3 fields".
  // Empty fields at the end do not count. Every field up to `most` may be read; absent fields are empty.
  FieldReader(const InpLexer& lexer, const DataLine& line, std::size_t least, std::size_t most,
              const std::string& layout);

  std::string_view text(std::size_t field) const;
  bool is_empty(std::size_t field) const { return text(field).empty(); }

  double number(std::size_t field) const;                     // an empty field is 0, as in Abaqus
  double number(std::size_t field, double fallback) const;    // an empty field is `fallback`
  int integer(std::size_t field, const char* meaning) const;  // `meaning` names the field in messages
  int label(std::size_t field, const char* meaning) const;    // an integer above 0
  int axis(std::size_t field) const;                          // degree of freedom 1, 2, 3 -> 0, 1, 2

  // Reads a label, a label of an instance ("ORGAN-1.5"), or the name of a known set.
  DraftTarget node_or_set(std::size_t field, const Draft& draft) const;
  DraftTarget element_or_set(std::size_t field, const Draft& draft) const;

 private:
  DraftTarget label_or_set(std::size_t field, const Draft& draft, const DraftSets& sets,
                           const char* item) const;

  const InpLexer& lexer_;
  const DataLine& line_;
};

// Whether a field of a set or load is a name: its first character cannot start a number.
bool is_name(std::string_view field);

// Returns `label` of an instance with this offset as a label of the assembled model. Too large a label
// becomes the largest integer, which no node and no element of an instance has.
int shifted_label(int label, int offset);

// Returns the index of a set named at `place`; throws InputError with the nearest known name.
int known_set(const InpLexer& lexer, const DraftSets& sets, const char* kind, std::string_view name,
              Place place);

}  // namespace palpate
