#include "offline/mesh/inp_load_keywords.hpp"

#include <algorithm>
#include <array>

#include "offline/mesh/inp_fields.hpp"
#include "offline/mesh/inp_remedies.hpp"
#include "offline/mesh/nearest_name.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// Records OP=. The first line of a keyword decides for the step; an OP= of other lines must agree.
void read_op(const InpLexer& lexer, const KeywordLine& keyword, DraftOp& op) {
  if (op.given && keyword.find("OP") == nullptr) return;
  std::string value = "MOD";
  if (keyword.find("OP") != nullptr) value = normalised_name(lexer.required_value(keyword, "OP"));
  if (value != "MOD" && value != "NEW")
    lexer.fail(keyword.place,
               keyword.shown + ", OP=" + printable(value) + " is neither MOD nor NEW; correct it");
  const bool is_new = value == "NEW";
  if (op.given && op.is_new != is_new) {
    lexer.fail(keyword.place, "an earlier " + keyword.shown + " of this step has OP=" +
                                  (op.is_new ? "NEW" : "MOD") + "; write the same in all of them");
  }
  op = {true, is_new};
}

// Reads a required magnitude: an empty field is more likely an omission than 0.
double magnitude_of(const InpLexer& lexer, const DataLine& line, const FieldReader& fields) {
  if (fields.is_empty(2)) lexer.fail(line.place, "the magnitude is missing; write it in the third field");
  return fields.number(2);
}

void refuse_direction(const InpLexer& lexer, const DataLine& line, const FieldReader& fields) {
  for (std::size_t i = 3; i < 6; ++i) {
    if (!fields.is_empty(i))
      lexer.fail(line.place, "a pressure has no direction; remove what follows its magnitude");
  }
}

// Returns the index of the amplitude of AMPLITUDE=, or kRamp.
int amplitude_of(const InpLexer& lexer, const KeywordLine& keyword, const Draft& draft) {
  if (keyword.find("AMPLITUDE") == nullptr) return kRamp;
  const std::string name = normalised_name(lexer.required_value(keyword, "AMPLITUDE"));
  std::vector<std::string> names;
  for (const Amplitude& amplitude : draft.amplitudes) {
    if (amplitude.name == name) return static_cast<int>(names.size());
    names.push_back(amplitude.name);
  }
  lexer.fail_unknown(keyword.place, name,
                     "amplitude " + printable(name) + " is not defined above this line" +
                         did_you_mean(name, names, "; define it with *AMPLITUDE"));
}

// Reads OP= and AMPLITUDE= of a load. Refuses other parameters, except `others`.
int read_load_parameters(const InpLexer& lexer, const KeywordLine& keyword, const Draft& draft, DraftOp& op,
                         std::initializer_list<std::string_view> others = {}) {
  std::vector<std::string_view> known = {"OP", "AMPLITUDE"};
  known.insert(known.end(), others);
  lexer.allow_parameters(keyword, known);
  read_op(lexer, keyword, op);
  return amplitude_of(lexer, keyword, draft);
}

// A support by name. The rotations that it holds besides have no meaning in a solid.
struct NamedSupport {
  const char* name;
  int first_axis;
  int last_axis;
};
constexpr std::array kNamedSupports = {NamedSupport{"ENCASTRE", 0, 2}, NamedSupport{"PINNED", 0, 2},
                                       NamedSupport{"XSYMM", 0, 0}, NamedSupport{"YSYMM", 1, 1},
                                       NamedSupport{"ZSYMM", 2, 2}};

// Reads a support by name. Refuses other names and further fields.
void read_named_support(const InpLexer& lexer, const DataLine& line, const FieldReader& fields,
                        DraftDisplacement& displacement) {
  const std::string type = normalised_name(fields.text(1));
  const auto support = std::find_if(kNamedSupports.begin(), kNamedSupports.end(),
                                    [&](const NamedSupport& known) { return known.name == type; });
  if (support == kNamedSupports.end()) {
    lexer.fail(line.place, "boundary type " + printable(type) +
                               " is not supported; write the degrees of freedom, such as 1, 3");
  }
  if (!fields.is_empty(2) || !fields.is_empty(3))
    lexer.fail(line.place, "nothing may follow " + type + "; remove it");
  displacement.first_axis = support->first_axis;
  displacement.last_axis = support->last_axis;
}

// Reads the degrees of freedom and the value. Returns false where they are rotations at zero, which the nodes
// of solids do not have.
bool read_dofs(const FieldReader& fields, Draft& draft, DraftDisplacement& displacement) {
  constexpr int kLastRotation = 6;
  const char* meaning = "degree of freedom";
  const int first = fields.integer(1, meaning);
  const int last = fields.is_empty(2) ? first : fields.integer(2, meaning);
  displacement.value = fields.number(3);
  const bool rotations = displacement.value == 0 && first >= 1 && last > 3 && last <= kLastRotation;
  if (rotations) draft.pass_over("rotations of *BOUNDARY");
  if (rotations && first > 3 && first <= last) return false;
  displacement.first_axis = fields.axis(1);
  displacement.last_axis = rotations ? 2 : fields.is_empty(2) ? displacement.first_axis : fields.axis(2);
  return true;
}

// *BOUNDARY means TYPE=DISPLACEMENT by default.
void check_boundary_type(const InpLexer& lexer, const KeywordLine& keyword) {
  const Parameter* type = keyword.find("TYPE");
  if (type == nullptr || normalised_name(type->value.value_or("")) == "DISPLACEMENT") return;
  lexer.fail(keyword.place, "*BOUNDARY, TYPE=" + printable(normalised_name(type->value.value_or(""))) +
                                " is not supported" + parameter_remedy(keyword, *type, {}));
}

// Returns the unit vector along the components in fields 3 to 5.
Eigen::Vector3d direction_of(const InpLexer& lexer, const DataLine& line, const FieldReader& fields) {
  const Eigen::Vector3d direction(fields.number(3), fields.number(4), fields.number(5));
  const double length = direction.stableNorm();
  if (!(length > 0))
    lexer.fail(line.place, "the direction is zero; write its three components behind the magnitude");
  return direction / length;
}

// Whether a parameter is YES; `fallback` where the parameter is absent.
bool is_yes(const InpLexer& lexer, const KeywordLine& keyword, std::string_view parameter, bool fallback) {
  const Parameter* found = keyword.find(parameter);
  if (found == nullptr) return fallback;
  const std::string value = normalised_name(found->value.value_or("YES"));
  if (value != "YES" && value != "NO")
    lexer.fail(keyword.place, found->shown + "=" + printable(value) + " is neither YES nor NO; correct it");
  return value == "YES";
}

}  // namespace

void read_amplitude(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  lexer.allow_parameters(keyword, {"NAME", "TIME", "DEFINITION", "VALUE"});
  Amplitude amplitude;
  amplitude.name = normalised_name(lexer.required_value(keyword, "NAME"));
  for (const Amplitude& other : draft.amplitudes) {
    if (other.name == amplitude.name)
      lexer.fail(keyword.place,
                 "amplitude " + printable(other.name) + " is already defined; give this one another name");
  }
  const auto expect = [&](const char* parameter, const char* only) {
    if (keyword.find(parameter) == nullptr) return;
    const std::string value = normalised_name(lexer.required_value(keyword, parameter));
    if (value != only)
      lexer.fail(keyword.place, "*AMPLITUDE, " + std::string(parameter) + "=" + printable(value) +
                                    " is not supported; write a table of times and factors, " + parameter +
                                    "=" + only);
  };
  expect("DEFINITION", "TABULAR");
  expect("VALUE", "RELATIVE");
  if (keyword.find("TIME") != nullptr) {
    const std::string time = normalised_name(lexer.required_value(keyword, "TIME"));
    if (time != "TOTALTIME" && time != "STEPTIME")
      lexer.fail(keyword.place,
                 "TIME=" + printable(time) + " is neither STEP TIME nor TOTAL TIME; correct it");
    amplitude.total_time = time == "TOTALTIME";
  }
  while (const DataLine* line = lexer.next_data()) {
    const FieldReader fields(lexer, *line, 2, 8, "up to four pairs of time and factor");
    for (std::size_t i = 0; i < 8; i += 2) {
      if (fields.is_empty(i) && fields.is_empty(i + 1)) continue;
      const double time = fields.number(i);
      if (fields.is_empty(i) || fields.is_empty(i + 1))
        lexer.fail(line->place, "a time or a factor is missing; write pairs of time and factor");
      if (!amplitude.points.empty() && time <= amplitude.points.back()[0])
        lexer.fail(line->place, "the times of an amplitude must grow; correct them");
      amplitude.points.push_back({time, fields.number(i + 1)});
    }
  }
  if (amplitude.points.empty())
    lexer.fail(keyword.place,
               "amplitude " + printable(amplitude.name) + " has no points; add pairs of time and factor");
  draft.amplitudes.push_back(std::move(amplitude));
}

void read_boundary(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  const bool in_step = draft.in_step();
  if (!in_step && !draft.steps.empty()) {
    lexer.fail_following(keyword.place,
                         "*BOUNDARY stands between two steps; move it into a step or before the first");
  }
  int amplitude = kRamp;
  if (in_step) {
    amplitude =
        read_load_parameters(lexer, keyword, draft, draft.steps.back().boundary_op, {"FIXED", "TYPE"});
  } else {
    DraftOp op;
    lexer.allow_parameters(keyword, {"OP", "FIXED", "TYPE"});
    read_op(lexer, keyword, op);
    if (op.is_new)
      lexer.fail(keyword.place, "*BOUNDARY, OP=NEW before the first *STEP removes nothing; take it out");
  }
  check_boundary_type(lexer, keyword);
  const bool keeps = keyword.find("FIXED") != nullptr;
  std::vector<DraftDisplacement>& displacements = in_step ? draft.steps.back().prescribed : draft.fixed;
  while (const DataLine* line = lexer.next_data()) {
    const FieldReader fields(lexer, *line, 2, 4, "node or set, first dof, last dof, value");
    DraftDisplacement displacement;
    displacement.target = fields.node_or_set(0, draft);
    displacement.amplitude = amplitude;
    displacement.keeps = keeps;
    displacement.place = line->place;
    if (is_name(fields.text(1))) {
      read_named_support(lexer, *line, fields, displacement);
    } else if (!read_dofs(fields, draft, displacement)) {
      continue;
    }
    if (displacement.last_axis < displacement.first_axis) {
      lexer.fail(line->place, "the last degree of freedom is before the first; exchange them");
    }
    if (!in_step && !keeps && displacement.value != 0) {
      lexer.fail(line->place, "a displacement other than 0 before the first *STEP; move it into a step");
    }
    displacements.push_back(displacement);
  }
}

void read_cload(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  DraftStep& step = draft.steps.back();
  const int amplitude = read_load_parameters(lexer, keyword, draft, step.cload_op);
  while (const DataLine* line = lexer.next_data()) {
    const FieldReader fields(lexer, *line, 2, 3, "node or set, dof, force");
    DraftForce force;
    force.target = fields.node_or_set(0, draft);
    force.axis = fields.axis(1);
    force.value = fields.number(2);
    force.amplitude = amplitude;
    force.place = line->place;
    step.forces.push_back(force);
  }
}

void read_dload(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  DraftStep& step = draft.steps.back();
  const int amplitude = read_load_parameters(lexer, keyword, draft, step.dload_op);
  while (const DataLine* line = lexer.next_data()) {
    const FieldReader fields(lexer, *line, 3, 6,
                             "element or set, GRAV or P1 to P4, magnitude, for GRAV a direction");
    const std::string kind = normalised_name(fields.text(1));
    DraftTarget elements;
    if (kind != "GRAV" || !fields.is_empty(0)) elements = fields.element_or_set(0, draft);
    if (kind == "GRAV") {
      const Eigen::Vector3d direction = direction_of(lexer, *line, fields);
      step.gravity.push_back(
          {elements, magnitude_of(lexer, *line, fields) * direction, amplitude, line->place});
      continue;
    }
    if (kind.size() != 2 || kind[0] != 'P' || kind[1] < '1' || kind[1] > '4') {
      lexer.fail(line->place, "distributed load " + printable(kind) +
                                  " is not supported; write P1 to P4 for a pressure on a face, or GRAV");
    }
    refuse_direction(lexer, *line, fields);
    step.pressures.push_back({{elements, kind[1] - '1', line->place},
                              -1,
                              magnitude_of(lexer, *line, fields),
                              amplitude,
                              line->place});
  }
}

void read_dsload(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  DraftStep& step = draft.steps.back();
  const int amplitude =
      read_load_parameters(lexer, keyword, draft, step.dsload_op, {"FOLLOWER", "CONSTANTRESULTANT"});
  while (const DataLine* line = lexer.next_data()) {
    const FieldReader fields(lexer, *line, 3, 6, "surface, P or TRVEC, magnitude, for TRVEC a direction");
    if (fields.is_empty(0)) lexer.fail(line->place, "the surface is missing; name one of *SURFACE");
    const std::string name = normalised_name(fields.text(0));
    std::vector<std::string> names;
    for (const DraftSurface& surface : draft.surfaces) names.push_back(surface.name);
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      lexer.fail_unknown(line->place, name,
                         "surface " + printable(name) + " is not defined above this line" +
                             did_you_mean(name, names, "; define it with *SURFACE"));
    }
    const int surface = static_cast<int>(found - names.begin());
    if (draft.surfaces[static_cast<std::size_t>(surface)].of_nodes)
      lexer.fail(line->place,
                 "surface " + printable(name) +
                     " has nodes only, which no pressure acts on; define it by faces of elements");
    const std::string kind = normalised_name(fields.text(1));
    if (kind == "P") {
      refuse_direction(lexer, *line, fields);
      if (step.nlgeom && !is_yes(lexer, keyword, "FOLLOWER", true))
        lexer.fail(keyword.place, "a pressure follows its surface; remove FOLLOWER, or write TRVEC");
      step.pressures.push_back({{}, surface, magnitude_of(lexer, *line, fields), amplitude, line->place});
    } else if (kind == "TRVEC") {
      if (step.nlgeom &&
          (is_yes(lexer, keyword, "FOLLOWER", true) || !is_yes(lexer, keyword, "CONSTANTRESULTANT", false))) {
        lexer.fail(
            keyword.place,
            "a traction that turns or grows with its surface is not supported; write FOLLOWER=NO, CONSTANT "
            "RESULTANT=YES, or use a pressure");
      }
      const Eigen::Vector3d direction = direction_of(lexer, *line, fields);
      step.tractions.push_back(
          {{}, surface, magnitude_of(lexer, *line, fields) * direction, amplitude, line->place});
    } else {
      lexer.fail(line->place, "surface load " + printable(kind) + " is not supported; write P or TRVEC");
    }
  }
}

}  // namespace palpate
