// The fields of a data line as numbers and names, with the message that says what is wrong with one.
#pragma once

#include <string>

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

class FieldReader {
 public:
  // A line with more than `most` fields, empty ones at its end not counted, or fewer than `least`, is
  // refused: "expected `layout`, found 3 fields". Every field up to `most` may then be asked for; those not
  // there are empty.
  FieldReader(const InpLexer& lexer, const DataLine& line, std::size_t least, std::size_t most,
              const std::string& layout);

  std::string_view text(std::size_t field) const;
  bool is_empty(std::size_t field) const { return text(field).empty(); }

  double number(std::size_t field) const;                   // an empty field is 0, as in Abaqus
  double number(std::size_t field, double fallback) const;  // an empty field is `fallback`
  int integer(std::size_t field, const char* meaning) const;
  int label(std::size_t field, const char* meaning) const;  // an integer above 0
  int axis(std::size_t field) const;                        // degree of freedom 1, 2, 3 -> 0, 1, 2

  // A label, or the name of a set that is already known.
  DraftTarget node_or_set(std::size_t field, const Draft& draft) const;
  DraftTarget element_or_set(std::size_t field, const Draft& draft) const;

 private:
  DraftTarget label_or_set(std::size_t field, const DraftSets& sets, const char* item) const;

  const InpLexer& lexer_;
  const DataLine& line_;
};

// Whether a field of a set or load is a name: it does not begin like a number.
bool is_name(std::string_view field);

// Index of a set named at `place`, or InputError with the nearest known name.
int known_set(const InpLexer& lexer, const DraftSets& sets, const char* kind, std::string_view name,
              Place place);

}  // namespace palpate
