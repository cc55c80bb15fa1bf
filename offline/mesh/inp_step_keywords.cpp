#include "offline/mesh/inp_step_keywords.hpp"

#include <algorithm>
#include <limits>

#include "offline/mesh/inp_fields.hpp"
#include "offline/mesh/inp_passed_over.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

void require(const InpLexer& lexer, const DataLine& line, bool good, const std::string& message) {
  if (!good) lexer.fail(line.place, message);
}

// Reads increments of time or arc length as fractions of their total. Empty and zero take Abaqus' defaults:
// total 1, initial increment = total, least increment 1e-5 of the total.
void read_increments(const InpLexer& lexer, const DataLine& line, const FieldReader& fields, bool riks,
                     Step& step) {
  const std::string total_name = riks ? "total arc length" : "period";
  const auto given = [&](std::size_t field, double fallback) {
    const double value = fields.number(field);
    require(lexer, line, value >= 0,
            riks ? "arc lengths cannot be negative; correct them"
                 : "increments and periods cannot be negative; correct them");
    return value == 0 ? fallback : value;
  };
  const double total = given(1, 1.0);
  const double initial = given(0, total);
  const double smallest = given(2, std::min(initial, 1e-5 * total));
  const double largest = given(3, riks ? std::numeric_limits<double>::infinity() : total);
  require(lexer, line, initial <= total,
          "the initial increment is longer than the " + total_name + "; shorten it");
  require(lexer, line, smallest <= initial,
          "the smallest increment is longer than the initial one; shorten it");
  require(lexer, line, largest >= smallest,
          "the largest increment is shorter than the smallest; lengthen it");
  if (!riks) step.period = total;
  step.largest_increment = riks ? largest / total : std::min(largest / total, 1.0);
  step.first_increment = std::min(initial / total, step.largest_increment);
  step.smallest_increment = smallest / total;
}

// Reads the end of the path of *STATIC, RIKS from fields 5 to 8 of its data line.
void read_path_end(const InpLexer& lexer, const DataLine& line, const FieldReader& fields, DraftRiks& riks) {
  riks.data_place = line.place;
  if (!fields.is_empty(4)) {
    riks.control.end_load_factor = fields.number(4);
    require(lexer, line, *riks.control.end_load_factor > 0,
            "the largest load factor is not above 0; leave it out, or turn the load round");
  }
  if (fields.is_empty(5)) {
    require(lexer, line, fields.is_empty(6) && fields.is_empty(7),
            "the node of the monitored displacement is missing; write it in the sixth field");
    return;
  }
  riks.node_label = fields.label(5, "node");
  require(lexer, line, !fields.is_empty(6),
          "the degree of freedom of the monitored node is missing; write 1 (x), 2 (y) or 3 (z) behind it");
  riks.control.axis = fields.axis(6);
  if (!fields.is_empty(7)) riks.control.end_displacement = fields.number(7);
}

}  // namespace

void read_step(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  // NAME is Abaqus/CAE's name of the step and has no effect.
  allow_parameters(lexer, keyword, draft, {"NLGEOM", "INC", "NAME", "AMPLITUDE"},
                   {"EXTRAPOLATION", "UNSYMM", "CONVERTSDI", "SOLVER"});
  const Parameter* amplitude = keyword.find("AMPLITUDE");
  if (amplitude != nullptr && normalised_name(amplitude->value.value_or("")) != "RAMP")
    lexer.fail(keyword.place,
               "*STEP, AMPLITUDE is not supported: loads grow over the step, as with AMPLITUDE=RAMP; name an "
               "*AMPLITUDE in the loads instead");
  if (draft.in_step()) {
    lexer.fail(keyword.place, "*STEP inside the step of line " +
                                  std::to_string(draft.steps.back().place.line) +
                                  "; end that one with *END STEP");
  }
  if (!draft.steps.empty() && draft.steps.back().riks) {
    lexer.fail(keyword.place, "a step follows the *STATIC, RIKS of line " +
                                  std::to_string(draft.steps.back().riks->place.line) +
                                  ", whose loads end at a factor that only the solve finds; make that step "
                                  "the last");
  }
  const Parameter* nlgeom = keyword.find("NLGEOM");
  const std::string value = nlgeom == nullptr ? "NO" : normalised_name(nlgeom->value.value_or("YES"));
  if (value != "YES" && value != "NO")
    lexer.fail(keyword.place, "NLGEOM=" + printable(value) + " is neither YES nor NO; correct it");
  DraftStep step;
  step.place = keyword.place;
  step.nlgeom = value == "YES";
  // As in Abaqus, NLGEOM holds for all later steps.
  if (!draft.steps.empty() && draft.steps.front().nlgeom) step.nlgeom = true;
  if (!draft.steps.empty() && step.nlgeom != draft.steps.front().nlgeom) {
    lexer.fail_following(keyword.place,
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
    if (parameter.name == "RIKS" && !parameter.value) continue;
    // Increments of fixed size and the solver of linear equations lead to the same equilibrium.
    if (parameter.name == "DIRECT" || parameter.name == "SOLVER") {
      draft.pass_over(parameter.shown + " of *STATIC");
      continue;
    }
    lexer.fail(keyword.place,
               "*STATIC, " + parameter.shown + " is not supported; write *STATIC, which steps automatically");
  }
  DraftStep& step = draft.steps.back();
  if (step.has_static) lexer.fail(keyword.place, "*STATIC is given twice in this step; keep one");
  step.has_static = true;
  const bool riks = keyword.find("RIKS") != nullptr;
  if (riks) {
    step.riks.emplace().place = keyword.place;
    step.step.largest_increment = std::numeric_limits<double>::infinity();
  }
  const DataLine* line = lexer.next_data();
  if (line == nullptr) return;
  const FieldReader fields =
      riks ? FieldReader(lexer, *line, 1, 8,
                         "initial arc increment, total arc length, smallest, largest increment, largest load "
                         "factor, node, dof, displacement")
           : FieldReader(lexer, *line, 1, 4, "initial increment, period, smallest, largest increment");
  read_increments(lexer, *line, fields, riks, step.step);
  if (riks) read_path_end(lexer, *line, fields, *step.riks);
}

void read_end_step(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  DraftStep& step = draft.steps.back();
  step.ended = true;
  lexer.allow_parameters(keyword, {});
  if (!step.has_static) {
    lexer.fail_following(keyword.place, "the step of line " + std::to_string(step.place.line) +
                                            " has no procedure; write *STATIC after *STEP");
  }
}

}  // namespace palpate
