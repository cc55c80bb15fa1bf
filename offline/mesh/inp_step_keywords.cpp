#include "offline/mesh/inp_step_keywords.hpp"

#include <algorithm>

#include "offline/mesh/inp_fields.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

void require(const InpLexer& lexer, const DataLine& line, bool good, const std::string& message) {
  if (!good) lexer.fail(line.place, message);
}

}  // namespace

void read_step(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  // NAME is what Abaqus/CAE calls the step: it changes nothing.
  lexer.allow_parameters(keyword, {"NLGEOM", "INC", "NAME"});
  if (draft.in_step()) {
    lexer.fail(keyword.place, "*STEP inside the step of line " +
                                  std::to_string(draft.steps.back().place.line) +
                                  "; end that one with *END STEP");
  }
  const Parameter* nlgeom = keyword.find("NLGEOM");
  const std::string value = nlgeom == nullptr ? "NO" : normalised_name(nlgeom->value.value_or("YES"));
  if (value != "YES" && value != "NO")
    lexer.fail(keyword.place, "NLGEOM=" + printable(value) + " is neither YES nor NO; correct it");
  DraftStep step;
  step.place = keyword.place;
  step.nlgeom = value == "YES";
  // As in Abaqus, what follows a step with NLGEOM has it too.
  if (!draft.steps.empty() && draft.steps.front().nlgeom) step.nlgeom = true;
  if (!draft.steps.empty() && step.nlgeom != draft.steps.front().nlgeom) {
    lexer.fail(keyword.place,
               "NLGEOM begins in a later step than the first; write it in the first, or in none");
  }
  if (keyword.find("INC") != nullptr) {
    const std::string increments = lexer.required_value(keyword, "INC");
    const std::optional<int> count = parse_integer(increments);
    if (!count || *count < 1) {
      lexer.fail(keyword.place,
                 "INC=" + printable(increments) + " is no number of increments; write 1 or more");
    }
    step.step.max_increments = *count;
  }
  // The lines below *STEP are its title.
  while (lexer.next_data() != nullptr) {
  }
  draft.steps.push_back(std::move(step));
}

void read_static(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  for (const Parameter& parameter : keyword.parameters) {
    lexer.fail(keyword.place,
               "*STATIC, " + parameter.shown + " is not supported; write *STATIC, which steps automatically");
  }
  DraftStep& step = draft.steps.back();
  if (step.has_static) lexer.fail(keyword.place, "*STATIC is given twice in this step; keep one");
  step.has_static = true;
  const DataLine* line = lexer.next_data();
  if (line == nullptr) return;
  const FieldReader fields(lexer, *line, 1, 4, "initial increment, period, smallest, largest increment");
  // Empty and zero mean the default in Abaqus: a period of 1, the whole of it at once, 1e-5 of it at least.
  const auto given = [&](std::size_t field, double fallback) {
    const double value = fields.number(field);
    require(lexer, *line, value >= 0, "increments and periods cannot be negative; correct them");
    return value == 0 ? fallback : value;
  };
  const double period = given(1, 1.0);
  const double initial = given(0, period);
  const double smallest = given(2, std::min(initial, 1e-5 * period));
  const double largest = given(3, period);
  require(lexer, *line, initial <= period, "the initial increment is longer than the period; shorten it");
  require(lexer, *line, smallest <= initial,
          "the smallest increment is longer than the initial one; shorten it");
  require(lexer, *line, largest >= smallest,
          "the largest increment is shorter than the smallest; lengthen it");
  step.step.period = period;
  step.step.largest_increment = std::min(largest / period, 1.0);
  step.step.first_increment = std::min(initial / period, step.step.largest_increment);
  step.step.smallest_increment = smallest / period;
}

void read_end_step(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  lexer.allow_parameters(keyword, {});
  DraftStep& step = draft.steps.back();
  if (!step.has_static) {
    lexer.fail(keyword.place, "the step of line " + std::to_string(step.place.line) +
                                  " has no procedure; write *STATIC after *STEP");
  }
  step.ended = true;
}

}  // namespace palpate
