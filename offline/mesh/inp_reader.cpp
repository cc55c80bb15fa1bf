#include "offline/mesh/inp_reader.hpp"

#include <fmt/format.h>

#include <array>

#include "offline/mesh/inp_draft.hpp"
#include "offline/mesh/inp_element_keywords.hpp"
#include "offline/mesh/inp_fields.hpp"
#include "offline/mesh/inp_lexer.hpp"
#include "offline/mesh/inp_load_keywords.hpp"
#include "offline/mesh/inp_material_keywords.hpp"
#include "offline/mesh/inp_mesh_keywords.hpp"
#include "offline/mesh/inp_part_keywords.hpp"
#include "offline/mesh/inp_passed_over.hpp"
#include "offline/mesh/inp_refusals.hpp"
#include "offline/mesh/inp_remedies.hpp"
#include "offline/mesh/inp_resolve.hpp"
#include "offline/mesh/inp_step_keywords.hpp"
#include "offline/mesh/inp_ties.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// Where a keyword may stand: before the steps in a part or outside, before the steps outside of parts, in a
// step, outside of parts, or anywhere.
enum class Where { mesh, before_steps, in_step, outside_parts, anywhere };

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
    KeywordRule{"NODE", "*NODE", Where::mesh, read_nodes},
    KeywordRule{"ELEMENT", "*ELEMENT", Where::mesh, read_elements},
    KeywordRule{"NSET", "*NSET", Where::mesh, read_node_set},
    KeywordRule{"ELSET", "*ELSET", Where::mesh, read_element_set},
    KeywordRule{"SURFACE", "*SURFACE", Where::mesh, read_surface},
    KeywordRule{"PART", "*PART", Where::mesh, read_part},
    KeywordRule{"ENDPART", "*END PART", Where::mesh, read_end_part},
    KeywordRule{"ASSEMBLY", "*ASSEMBLY", Where::mesh, read_assembly},
    KeywordRule{"INSTANCE", "*INSTANCE", Where::mesh, read_instance},
    KeywordRule{"ENDINSTANCE", "*END INSTANCE", Where::mesh, read_end_instance},
    KeywordRule{"ENDASSEMBLY", "*END ASSEMBLY", Where::mesh, read_end_assembly},
    KeywordRule{"MATERIAL", "*MATERIAL", Where::before_steps, read_material},
    KeywordRule{"DENSITY", "*DENSITY", Where::before_steps, read_density},
    KeywordRule{"HYPERELASTIC", "*HYPERELASTIC", Where::before_steps, read_hyperelastic},
    KeywordRule{"ELASTIC", "*ELASTIC", Where::before_steps, read_elastic},
    KeywordRule{"SOLIDSECTION", "*SOLID SECTION", Where::mesh, read_solid_section},
    KeywordRule{"AMPLITUDE", "*AMPLITUDE", Where::outside_parts, read_amplitude},
    KeywordRule{"BOUNDARY", "*BOUNDARY", Where::outside_parts, read_boundary},
    KeywordRule{"TIE", "*TIE", Where::before_steps, read_tie},
    KeywordRule{"INITIALCONDITIONS", "*INITIAL CONDITIONS", Where::before_steps, read_initial_conditions},
    KeywordRule{"STEP", "*STEP", Where::outside_parts, read_step},
    KeywordRule{"STATIC", "*STATIC", Where::in_step, read_static},
    KeywordRule{"CLOAD", "*CLOAD", Where::in_step, read_cload},
    KeywordRule{"DLOAD", "*DLOAD", Where::in_step, read_dload},
    KeywordRule{"DSLOAD", "*DSLOAD", Where::in_step, read_dsload},
    KeywordRule{"NODEPRINT", "*NODE PRINT", Where::in_step, read_output_request},
    KeywordRule{"NODEFILE", "*NODE FILE", Where::in_step, read_output_request},
    KeywordRule{"ELFILE", "*EL FILE", Where::in_step, read_output_request},
    KeywordRule{"ENDSTEP", "*END STEP", Where::in_step, read_end_step},
    KeywordRule{"RESTART", "*RESTART", Where::anywhere, read_restart},
    // Requests for output.
    KeywordRule{"OUTPUT", "*OUTPUT", Where::anywhere, pass_over},
    KeywordRule{"NODEOUTPUT", "*NODE OUTPUT", Where::anywhere, pass_over},
    KeywordRule{"ELEMENTOUTPUT", "*ELEMENT OUTPUT", Where::anywhere, pass_over},
    KeywordRule{"ENERGYOUTPUT", "*ENERGY OUTPUT", Where::anywhere, pass_over},
    KeywordRule{"CONTACTOUTPUT", "*CONTACT OUTPUT", Where::anywhere, pass_over},
    KeywordRule{"ELPRINT", "*EL PRINT", Where::anywhere, pass_over},
    KeywordRule{"ENERGYPRINT", "*ENERGY PRINT", Where::anywhere, pass_over},
    KeywordRule{"ENERGYFILE", "*ENERGY FILE", Where::anywhere, pass_over},
    KeywordRule{"CONTACTFILE", "*CONTACT FILE", Where::anywhere, pass_over},
    KeywordRule{"CONTACTPRINT", "*CONTACT PRINT", Where::anywhere, pass_over},
    KeywordRule{"SECTIONPRINT", "*SECTION PRINT", Where::anywhere, pass_over},
    KeywordRule{"FILEFORMAT", "*FILE FORMAT", Where::anywhere, pass_over},
    KeywordRule{"MONITOR", "*MONITOR", Where::anywhere, pass_over},
    KeywordRule{"PREPRINT", "*PREPRINT", Where::anywhere, pass_over},
    KeywordRule{"PRINT", "*PRINT", Where::anywhere, pass_over},
    KeywordRule{"TIMEPOINTS", "*TIME POINTS", Where::anywhere, pass_over},
    // Convergence of another solver, axes of isotropic materials, and heat without expansion.
    KeywordRule{"CONTROLS", "*CONTROLS", Where::anywhere, pass_over},
    KeywordRule{"ORIENTATION", "*ORIENTATION", Where::anywhere, pass_over},
    KeywordRule{"PHYSICALCONSTANTS", "*PHYSICAL CONSTANTS", Where::anywhere, pass_over},
    KeywordRule{"CONDUCTIVITY", "*CONDUCTIVITY", Where::anywhere, pass_over},
    KeywordRule{"SPECIFICHEAT", "*SPECIFIC HEAT", Where::anywhere, pass_over},
};

const KeywordRule& rule_of(const InpLexer& lexer, const KeywordLine& keyword) {
  for (const KeywordRule& rule : kRules) {
    if (keyword.name == rule.name) return rule;
  }
  std::vector<std::string> known = {"*INCLUDE"};
  for (const KeywordRule& rule : kRules) known.emplace_back(rule.shown);
  lexer.fail(keyword.place, keyword.shown + " is not supported" + keyword_remedy(keyword, known));
}

void check_where(const InpLexer& lexer, const KeywordLine& keyword, const KeywordRule& rule,
                 const Draft& draft) {
  const DraftAssembly& assembly = draft.assembly;
  if (rule.where == Where::in_step && !draft.in_step()) {
    lexer.fail_following(keyword.place,
                         keyword.shown + " stands outside a step; move it between *STEP and *END STEP");
  }
  if ((rule.where == Where::before_steps || rule.where == Where::mesh) && !draft.steps.empty()) {
    lexer.fail(keyword.place, keyword.shown + " stands after *STEP; move it before the first step");
  }
  if (assembly.in_part() && rule.where != Where::mesh && rule.where != Where::anywhere) {
    lexer.fail_following(
        keyword.place,
        fmt::format("{} stands inside the {} of line {}; move it behind *END {}", keyword.shown,
                    assembly.keyword, assembly.place.line, assembly.keyword.substr(1)));
  }
}

// Gives the draft the structure that a refused keyword would have given, so that the next ones find their
// place.
void keep_structure(const KeywordLine& keyword, Draft& draft) {
  if (keyword.name == "MATERIAL") {
    draft.materials.emplace_back();
  } else if (keyword.name == "STEP" && !draft.assembly.in_part()) {
    if (draft.in_step()) draft.steps.back().ended = true;
    draft.steps.emplace_back();
    draft.steps.back().nlgeom = keyword.find("NLGEOM") != nullptr;
    draft.steps.back().place = keyword.place;
  } else if (keyword.name == "STATIC" && draft.in_step()) {
    draft.steps.back().has_static = true;
  }
}

// Reads the keywords of a file into a draft. Goes on at the next keyword after a refusal.
class Reading {
 public:
  Reading(const std::filesystem::path& file, const std::filesystem::path& include_root,
          bool keeps_mesh = true)
      : file_(file.string()), lexer_(file, include_root) {
    draft_.keeps_mesh = keeps_mesh;
  }

  void check() { read(); }

  Model run(double merge_length) {
    read();
    return resolve(draft_, lexer_.files(), file_, merge_length);
  }

  Model run_unchecked(double merge_length) {
    read();
    return resolve_unchecked(draft_, lexer_.files(), file_, merge_length);
  }

  Model run_mesh() {
    read();
    return resolve_mesh(draft_, lexer_.files(), file_);
  }

 private:
  void read() {
    attempt([&] { refuse_leading_data(); });
    while (next_keyword()) attempt([&] { read_keyword(); });
    attempt([&] { check_end(); });
    refusals_.throw_if_any();
    for (const std::string& warning : {passed_over_warning(draft_), shifted_labels_warning(draft_)}) {
      if (!warning.empty()) draft_.warnings.push_back(file_ + ": " + warning);
    }
    if (draft_.num_short_nodes > 0) {
      draft_.warnings.push_back(
          fmt::format("{}: {} nodes have fewer than three coordinates; the absent ones are 0", file_,
                      draft_.num_short_nodes));
    }
  }

  template <typename Action>
  void attempt(Action&& action) {
    try {
      action();
    } catch (const FollowingError& error) {
      if (refusals_.empty()) refusals_.add(error);
      recover();
    } catch (const InputError& error) {
      refusals_.add(error);
      recover();
    }
  }

  void recover() {
    if (keyword_ == nullptr) return;
    lexer_.note_refused(*keyword_);
    keep_structure(*keyword_, draft_);
  }

  void refuse_leading_data() {
    if (const DataLine* line = lexer_.next_data()) {
      lexer_.fail(line->place, "data before the first keyword: '" + printable(line->text) +
                                   "'; an .inp file begins with a keyword such as *NODE");
    }
  }

  bool next_keyword() {
    const KeywordLine* next = nullptr;
    keyword_ = nullptr;
    if (!refusals_.full()) attempt([&] { next = lexer_.next_keyword(); });
    keyword_ = next;
    return keyword_ != nullptr;
  }

  void read_keyword() {
    const KeywordRule& rule = rule_of(lexer_, *keyword_);
    check_where(lexer_, *keyword_, rule, draft_);
    const bool of_material =
        rule.read == read_hyperelastic || rule.read == read_elastic || rule.read == read_density;
    if (of_material && !below_material_) {
      lexer_.fail_following(keyword_->place,
                            keyword_->shown + " belongs to no material; move it below *MATERIAL");
    }
    if (rule.where != Where::anywhere) below_material_ = of_material || rule.read == read_material;
    rule.read(lexer_, *keyword_, draft_);
    if (const DataLine* line = lexer_.next_data()) {
      lexer_.fail(line->place, "unexpected data after " + std::string(rule.shown) + ": '" +
                                   printable(line->text) + "'; remove it");
    }
  }

  void check_end() {
    keyword_ = nullptr;
    if (draft_.in_step())
      lexer_.fail_following(draft_.steps.back().place, "the file ends inside this step; add *END STEP");
    if (draft_.assembly.level != DraftAssembly::Level::model) {
      lexer_.fail_following(draft_.assembly.place,
                            fmt::format("the file ends inside this {0}; add *END {1}",
                                        draft_.assembly.keyword, draft_.assembly.keyword.substr(1)));
    }
  }

  std::string file_;
  InpLexer lexer_;
  Draft draft_;
  Refusals refusals_;
  const KeywordLine* keyword_ = nullptr;  // the keyword being read
  bool below_material_ = false;
};

}  // namespace

// The files are read twice: a file with a mistake is refused before its mesh takes memory.
Model read_inp(const std::filesystem::path& file, const std::filesystem::path& include_root,
               double merge_length) {
  Reading(file, include_root, false).check();
  return Reading(file, include_root).run(merge_length);
}

Model read_inp_unchecked(const std::filesystem::path& file, double merge_length) {
  Reading(file, {}, false).check();
  return Reading(file, {}).run_unchecked(merge_length);
}

Model read_inp_mesh(const std::filesystem::path& file, const std::filesystem::path& include_root) {
  Reading(file, include_root, false).check();
  return Reading(file, include_root).run_mesh();
}

}  // namespace palpate
