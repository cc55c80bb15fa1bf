#include "offline/mesh/inp_reader.hpp"

#include <array>

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_fields.hpp"
#include "offline/mesh/inp_lexer.hpp"
#include "offline/mesh/inp_load_keywords.hpp"
#include "offline/mesh/inp_material_keywords.hpp"
#include "offline/mesh/inp_mesh_keywords.hpp"
#include "offline/mesh/inp_resolve.hpp"
#include "offline/mesh/inp_step_keywords.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/nearest_name.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

enum class Where { before_steps, in_step, anywhere };

struct KeywordRule {
  const char* name;   // normalised
  const char* shown;  // for messages
  Where where;
  void (*read)(InpLexer&, const KeywordLine&, Draft&);
};

// The lines below *HEADING are text for people.
void read_heading(InpLexer& lexer, const KeywordLine& keyword, Draft&) {
  lexer.allow_parameters(keyword, {});
  while (lexer.next_data() != nullptr) {
  }
}

// Output requests do not change the model: `solve` writes the whole field. With *STATIC, RIKS the requested
// node sets are watched along the path.
void read_output_request(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  const auto named_set = [&](const char* parameter, const DraftSets& sets, const char* kind) {
    const Parameter* found = keyword.find(parameter);
    if (found == nullptr || !found->value) return -1;
    return known_set(lexer, sets, kind, *found->value, keyword.place);
  };
  const int nodes = named_set("NSET", draft.node_sets, "node set");
  named_set("ELSET", draft.element_sets, "element set");
  const auto warn = [&](Place place, const std::string& message) {
    draft.warnings.emplace_back(InputError(lexer.files().at(place), message).what());
  };
  std::optional<DraftRiks>& riks = draft.steps.back().riks;
  const bool watches = riks && keyword.name != "ELFILE" && nodes >= 0;
  while (const DataLine* line = lexer.next_data()) {
    for (const std::string_view field : line->fields) {
      if (watches && !field.empty() && normalised_name(field) != "U")
        warn(line->place, printable(normalised_name(field)) + " is passed over: path.csv has displacements");
    }
  }
  if (watches) {
    riks->watched.push_back({nodes, keyword.place});
  } else {
    warn(keyword.place, keyword.shown + " is passed over: results are written for every node");
  }
}

constexpr std::array kRules = {
    KeywordRule{"HEADING", "*HEADING", Where::before_steps, read_heading},
    KeywordRule{"NODE", "*NODE", Where::before_steps, read_nodes},
    KeywordRule{"ELEMENT", "*ELEMENT", Where::before_steps, read_elements},
    KeywordRule{"NSET", "*NSET", Where::before_steps, read_node_set},
    KeywordRule{"ELSET", "*ELSET", Where::before_steps, read_element_set},
    KeywordRule{"SURFACE", "*SURFACE", Where::before_steps, read_surface},
    KeywordRule{"MATERIAL", "*MATERIAL", Where::before_steps, read_material},
    KeywordRule{"DENSITY", "*DENSITY", Where::before_steps, read_density},
    KeywordRule{"HYPERELASTIC", "*HYPERELASTIC", Where::before_steps, read_hyperelastic},
    KeywordRule{"ELASTIC", "*ELASTIC", Where::before_steps, read_elastic},
    KeywordRule{"SOLIDSECTION", "*SOLID SECTION", Where::before_steps, read_solid_section},
    KeywordRule{"AMPLITUDE", "*AMPLITUDE", Where::anywhere, read_amplitude},
    KeywordRule{"BOUNDARY", "*BOUNDARY", Where::anywhere, read_boundary},
    KeywordRule{"STEP", "*STEP", Where::anywhere, read_step},
    KeywordRule{"STATIC", "*STATIC", Where::in_step, read_static},
    KeywordRule{"CLOAD", "*CLOAD", Where::in_step, read_cload},
    KeywordRule{"DLOAD", "*DLOAD", Where::in_step, read_dload},
    KeywordRule{"DSLOAD", "*DSLOAD", Where::in_step, read_dsload},
    KeywordRule{"NODEPRINT", "*NODE PRINT", Where::in_step, read_output_request},
    KeywordRule{"NODEFILE", "*NODE FILE", Where::in_step, read_output_request},
    KeywordRule{"ELFILE", "*EL FILE", Where::in_step, read_output_request},
    KeywordRule{"ENDSTEP", "*END STEP", Where::in_step, read_end_step},
};

// Remedies for frequent keywords of other programs' exports.
struct Remedy {
  const char* name;
  const char* text;
};
constexpr std::array kRemedies = {
    Remedy{"PART", "export the model as a flat input file, without parts and instances"},
    Remedy{"ASSEMBLY", "export the model as a flat input file, without parts and instances"},
    Remedy{"INSTANCE", "export the model as a flat input file, without parts and instances"},
    Remedy{"DYNAMIC", "write *STATIC"},
};

[[noreturn]] void refuse_keyword(const InpLexer& lexer, const KeywordLine& keyword) {
  for (const Remedy& remedy : kRemedies) {
    if (keyword.name == remedy.name) {
      lexer.fail(keyword.place, keyword.shown + " is not supported; " + remedy.text);
    }
  }
  std::vector<std::string> known = {"*INCLUDE"};
  for (const KeywordRule& rule : kRules) known.emplace_back(rule.shown);
  lexer.fail(keyword.place,
             keyword.shown + " is not supported" + did_you_mean(keyword.shown, known, "; remove it"));
}

const KeywordRule& rule_of(const InpLexer& lexer, const KeywordLine& keyword) {
  for (const KeywordRule& rule : kRules) {
    if (keyword.name == rule.name) return rule;
  }
  refuse_keyword(lexer, keyword);
}

void check_where(const InpLexer& lexer, const KeywordLine& keyword, const KeywordRule& rule,
                 const Draft& draft) {
  if (rule.where == Where::in_step && !draft.in_step()) {
    lexer.fail(keyword.place, keyword.shown + " stands outside a step; move it between *STEP and *END STEP");
  }
  if (rule.where == Where::before_steps && !draft.steps.empty()) {
    lexer.fail(keyword.place, keyword.shown + " stands after *STEP; move it before the first step");
  }
}

}  // namespace

Model read_inp(const std::filesystem::path& file, const std::filesystem::path& include_root,
               double merge_length) {
  InpLexer lexer(file, include_root);
  Draft draft;
  if (const DataLine* line = lexer.next_data()) {
    lexer.fail(line->place, "data before the first keyword: '" + printable(line->text) +
                                "'; an .inp file begins with a keyword such as *NODE");
  }
  bool below_material = false;
  while (const KeywordLine* keyword = lexer.next_keyword()) {
    const KeywordRule& rule = rule_of(lexer, *keyword);
    check_where(lexer, *keyword, rule, draft);
    const bool of_material =
        keyword->name == "HYPERELASTIC" || keyword->name == "ELASTIC" || keyword->name == "DENSITY";
    if (of_material && !below_material)
      lexer.fail(keyword->place, keyword->shown + " belongs to no material; move it below *MATERIAL");
    below_material = of_material || keyword->name == "MATERIAL";
    rule.read(lexer, *keyword, draft);
    if (const DataLine* line = lexer.next_data()) {
      lexer.fail(line->place, "unexpected data after " + std::string(rule.shown) + ": '" +
                                  printable(line->text) + "'; remove it");
    }
  }
  if (draft.in_step()) {
    lexer.fail(draft.steps.back().place, "the file ends inside this step; add *END STEP");
  }
  return resolve(draft, lexer.files(), file.string(), merge_length);
}

}  // namespace palpate
