#include "offline/mesh/inp_passed_over.hpp"

#include <vector>

#include "offline/mesh/inp_fields.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {

void pass_over(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  while (lexer.next_data() != nullptr) {
  }
  draft.pass_over(keyword.shown);
}

void read_restart(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  if (keyword.find("READ") != nullptr) {
    lexer.fail(keyword.place,
               "*RESTART, READ goes on from another run; write the model and all its steps in this file");
  }
  pass_over(lexer, keyword, draft);
}

void read_initial_conditions(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  const std::string type = normalised_name(lexer.required_value(keyword, "TYPE"));
  // Without *EXPANSION, which is refused, temperatures change nothing.
  const bool temperatures = type == "TEMPERATURE";
  while (const DataLine* line = lexer.next_data()) {
    const FieldReader fields(lexer, *line, 1, line->fields.size(), "node, element or set, and values");
    for (std::size_t i = 1; i < line->fields.size() && !temperatures; ++i) {
      if (fields.number(i) == 0) continue;
      lexer.fail(line->place,
                 "*INITIAL CONDITIONS, TYPE=" + printable(type) +
                     " with values other than 0 is not supported: the body begins at rest, free of "
                     "stress; bring it into this state by a first *STEP");
    }
  }
  draft.pass_over(keyword.shown);
}

void allow_parameters(const InpLexer& lexer, const KeywordLine& keyword, Draft& draft,
                      std::initializer_list<std::string_view> known,
                      std::initializer_list<std::string_view> harmless) {
  std::vector<std::string_view> all(known);
  all.insert(all.end(), harmless.begin(), harmless.end());
  lexer.allow_parameters(keyword, all);
  for (const std::string_view name : harmless) {
    const Parameter* found = keyword.find(name);
    if (found != nullptr) draft.pass_over(found->shown + " of " + keyword.shown);
  }
}

std::string passed_over_warning(const Draft& draft) {
  std::string names;
  for (const auto& [name, count] : draft.passed_over) {
    if (!names.empty()) names += ", ";
    names += name;
    if (count > 1) names += " (" + std::to_string(count) + ")";
  }
  return names.empty() ? "" : "passed over, as they change no result: " + names;
}

}  // namespace palpate
