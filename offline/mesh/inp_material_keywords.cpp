#include "offline/mesh/inp_material_keywords.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "offline/mesh/inp_fields.hpp"
#include "offline/mesh/inp_passed_over.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// The numbers of a law and their first line, for messages.
struct Constants {
  std::vector<double> values;  // absent numbers at the end are 0, as in Abaqus
  Place place;
};

// Reads `count` numbers, eight to a line as in Abaqus; the first `required` numbers must be present.
Constants read_constants(InpLexer& lexer, const KeywordLine& keyword, std::size_t required, std::size_t count,
                         const char* layout) {
  constexpr std::size_t kPerLine = 8;
  Constants constants;
  constants.values.assign(count, 0.0);
  for (std::size_t first = 0; first < count; first += kPerLine) {
    const DataLine* line = lexer.next_data();
    if (line == nullptr) {
      if (first >= required) break;
      lexer.fail(keyword.place, fmt::format("{} needs a data line {}; add it", keyword.shown, layout));
    }
    if (first == 0) constants.place = line->place;
    const std::size_t here = std::min(kPerLine, count - first);
    const std::size_t needed = std::min(here, required > first ? required - first : 1);
    const FieldReader fields(lexer, *line, needed, here, layout);
    for (std::size_t i = 0; i < here; ++i) constants.values[first + i] = fields.number(i);
  }
  return constants;
}

DraftMaterial& material_without_law(const InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  DraftMaterial& material = draft.materials.back();
  if (material.has_law) {
    lexer.fail(keyword.place,
               "material " + printable(material.material.name) + " already has a law; keep one");
  }
  return material;
}

// Reads D_1, D_2, ... from `first` on. D_1 must be positive; a later D_i = 0 omits its term.
VolumetricEnergy volumetric_of(const InpLexer& lexer, const Constants& constants, std::size_t first) {
  VolumetricEnergy energy;
  for (std::size_t i = first; i < constants.values.size(); ++i) {
    const double d = constants.values[i];
    const std::size_t term = i - first;
    if (d == 0 && term == 0) {
      lexer.fail(
          constants.place,
          "D1 = 0 asks for an incompressible material, which these elements cannot be; write D1 = 2 / bulk "
          "modulus");
    }
    if (d < 0)
      lexer.fail(
          constants.place,
          fmt::format("D{} is below 0: the body would gain volume under pressure; correct it", term + 1));
    energy.inverse_d[term] = d == 0 ? 0 : 1 / d;
  }
  return energy;
}

void require_shear(const InpLexer& lexer, const Constants& constants, double shear, const char* formula) {
  if (shear > 0) return;
  lexer.fail(constants.place, fmt::format("the shear modulus at rest, {} = {:g}, must be above 0; correct it",
                                          formula, shear));
}

Law read_compressible_neo_hooke(InpLexer& lexer, const KeywordLine& keyword) {
  const Constants constants = read_constants(lexer, keyword, 2, 2, "mu, lambda");
  const double mu = constants.values[0];
  const double lambda = constants.values[1];
  if (mu <= 0) lexer.fail(constants.place, "the shear modulus mu must be above 0; correct it");
  // At small strain the bulk modulus is lambda + 2 mu / 3.
  if (3 * lambda + 2 * mu <= 0) {
    lexer.fail(constants.place,
               "lambda must be above -2/3 mu, or the body gains volume under pressure; correct it");
  }
  return CompressibleNeoHookean{mu, lambda};
}

Law read_neo_hooke(InpLexer& lexer, const KeywordLine& keyword) {
  const Constants constants = read_constants(lexer, keyword, 2, 2, "C10, D1");
  require_shear(lexer, constants, 2 * constants.values[0], "2 C10");
  InvariantLaw law;
  law.c10 = constants.values[0];
  law.volumetric = volumetric_of(lexer, constants, 1);
  return law;
}

Law read_mooney_rivlin(InpLexer& lexer, const KeywordLine& keyword) {
  const Constants constants = read_constants(lexer, keyword, 3, 3, "C10, C01, D1");
  require_shear(lexer, constants, 2 * (constants.values[0] + constants.values[1]), "2 (C10 + C01)");
  InvariantLaw law;
  law.c10 = constants.values[0];
  law.c01 = constants.values[1];
  law.volumetric = volumetric_of(lexer, constants, 2);
  return law;
}

Law read_yeoh(InpLexer& lexer, const KeywordLine& keyword) {
  const Constants constants = read_constants(lexer, keyword, 4, 6, "C10, C20, C30, D1, D2, D3");
  require_shear(lexer, constants, 2 * constants.values[0], "2 C10");
  InvariantLaw law;
  law.c10 = constants.values[0];
  law.c20 = constants.values[1];
  law.c30 = constants.values[2];
  law.volumetric = volumetric_of(lexer, constants, 3);
  return law;
}

// Returns N=, the number of terms of a law; 1 where it is not given, as in Abaqus.
std::size_t num_terms_of(const InpLexer& lexer, const KeywordLine& keyword, const char* law, int most) {
  if (keyword.find("N") == nullptr) return 1;
  const std::string text = lexer.required_value(keyword, "N");
  const std::optional<int> given = parse_integer(text);
  if (!given || *given < 1 || *given > most) {
    lexer.fail(keyword.place, fmt::format("{}, N={} is not supported; write {}", law, printable(text),
                                          most == 1 ? "N=1" : "N=1, 2 or 3"));
  }
  return static_cast<std::size_t>(*given);
}

// POLYNOMIAL with one term is MOONEY-RIVLIN.
Law read_polynomial(InpLexer& lexer, const KeywordLine& keyword) {
  num_terms_of(lexer, keyword, "POLYNOMIAL", 1);
  return read_mooney_rivlin(lexer, keyword);
}

// REDUCED POLYNOMIAL has the first terms of YEOH.
Law read_reduced_polynomial(InpLexer& lexer, const KeywordLine& keyword) {
  const std::size_t num_terms = num_terms_of(lexer, keyword, "REDUCED POLYNOMIAL", 3);
  const char* layouts[] = {"C10, D1", "C10, C20, D1, D2", "C10, C20, C30, D1, D2, D3"};
  const Constants constants =
      read_constants(lexer, keyword, num_terms + 1, 2 * num_terms, layouts[num_terms - 1]);
  require_shear(lexer, constants, 2 * constants.values[0], "2 C10");
  InvariantLaw law;
  law.c10 = constants.values[0];
  if (num_terms > 1) law.c20 = constants.values[1];
  if (num_terms > 2) law.c30 = constants.values[2];
  law.volumetric = volumetric_of(lexer, constants, num_terms);
  return law;
}

Law read_ogden(InpLexer& lexer, const KeywordLine& keyword) {
  const std::size_t num_terms = num_terms_of(lexer, keyword, "OGDEN", 3);
  const char* layouts[] = {"mu1, alpha1, D1", "mu1, alpha1, mu2, alpha2, D1, D2",
                           "mu1, alpha1, mu2, alpha2, mu3, alpha3, D1, D2, and D3 in the next line"};
  const Constants constants =
      read_constants(lexer, keyword, 2 * num_terms + 1, 3 * num_terms, layouts[num_terms - 1]);
  Ogden law;
  double shear = 0;
  for (std::size_t i = 0; i < num_terms; ++i) {
    law.terms.push_back({constants.values[2 * i], constants.values[2 * i + 1]});
    shear += law.terms.back().mu;
    if (law.terms.back().alpha == 0)
      lexer.fail(constants.place, fmt::format("alpha{} is 0, which no term can have; correct it", i + 1));
  }
  require_shear(lexer, constants, shear, "the sum of mu_i");
  law.volumetric = volumetric_of(lexer, constants, 2 * num_terms);
  return law;
}

struct LawRule {
  const char* name;   // normalised
  const char* shown;  // for messages
  Law (*read)(InpLexer&, const KeywordLine&);
  bool has_terms = false;  // N= gives their number
};
constexpr std::array kLaws = {
    LawRule{"COMPRESSIBLENEOHOOKE", "COMPRESSIBLE NEO HOOKE", read_compressible_neo_hooke},
    LawRule{"NEOHOOKE", "NEO HOOKE", read_neo_hooke},
    LawRule{"MOONEY-RIVLIN", "MOONEY-RIVLIN", read_mooney_rivlin},
    LawRule{"YEOH", "YEOH", read_yeoh},
    LawRule{"OGDEN", "OGDEN", read_ogden, true},
    LawRule{"POLYNOMIAL", "POLYNOMIAL", read_polynomial, true},
    LawRule{"REDUCEDPOLYNOMIAL", "REDUCED POLYNOMIAL", read_reduced_polynomial, true}};

// Without *VISCOELASTIC, which is refused, moduli of short and of long times are the same.
void check_moduli(const InpLexer& lexer, const KeywordLine& keyword) {
  if (keyword.find("MODULI") == nullptr) return;
  const std::string moduli = normalised_name(lexer.required_value(keyword, "MODULI"));
  if (moduli != "LONGTERM" && moduli != "INSTANTANEOUS")
    lexer.fail(keyword.place,
               "MODULI=" + printable(moduli) + " is neither LONG TERM nor INSTANTANEOUS; correct it");
}

std::string law_names() {
  std::string names;
  for (std::size_t i = 0; i < kLaws.size(); ++i)
    names += fmt::format("{}{}", i == 0 ? "" : i + 1 < kLaws.size() ? ", " : " or ", kLaws[i].shown);
  return names;
}

}  // namespace

void read_material(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  lexer.allow_parameters(keyword, {"NAME"});
  DraftMaterial material;
  material.material.name = normalised_name(lexer.required_value(keyword, "NAME"));
  material.place = keyword.place;
  for (const DraftMaterial& other : draft.materials) {
    if (other.material.name == material.material.name) {
      lexer.fail(keyword.place, "material " + printable(other.material.name) + " is already defined at " +
                                    location(lexer.files().at(other.place)) + "; give this one another name");
    }
  }
  draft.materials.push_back(material);
}

void read_density(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  lexer.allow_parameters(keyword, {});
  const Constants constants = read_constants(lexer, keyword, 1, 1, "density");
  if (draft.materials.back().material.density != 0)
    lexer.fail(keyword.place, "*DENSITY is given twice in this material; keep one");
  if (constants.values[0] <= 0) lexer.fail(constants.place, "the density must be above 0; correct it");
  draft.materials.back().material.density = constants.values[0];
}

void read_hyperelastic(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  const LawRule* law = nullptr;
  for (const LawRule& rule : kLaws) {
    if (keyword.find(rule.name) == nullptr) continue;
    if (law != nullptr) lexer.fail(keyword.place, keyword.shown + " names two laws; keep one");
    law = &rule;
  }
  for (const Parameter& parameter : keyword.parameters) {
    const bool known = parameter.name == "MODULI" ||
                       (parameter.name == "N" && law != nullptr && law->has_terms) ||
                       std::any_of(kLaws.begin(), kLaws.end(),
                                   [&](const LawRule& rule) { return parameter.name == rule.name; });
    if (known) continue;
    if (parameter.name == "TESTDATAINPUT") {
      lexer.fail(keyword.place,
                 "*HYPERELASTIC, TEST DATA INPUT is not supported; fit the constants of a law first, "
                 "and write them in the data line");
    }
    lexer.fail(keyword.place,
               keyword.shown + ", " + parameter.shown + " is not supported; write one of " + law_names());
  }
  if (law == nullptr) lexer.fail(keyword.place, keyword.shown + " names no law; write one of " + law_names());
  check_moduli(lexer, keyword);
  DraftMaterial& material = material_without_law(lexer, keyword, draft);
  material.material.law = law->read(lexer, keyword);
  material.has_law = true;
}

void read_elastic(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  lexer.allow_parameters(keyword, {"TYPE", "MODULI"});
  check_moduli(lexer, keyword);
  if (keyword.find("TYPE") != nullptr) {
    const std::string type = normalised_name(lexer.required_value(keyword, "TYPE"));
    if (type != "ISO" && type != "ISOTROPIC")
      lexer.fail(keyword.place,
                 "*ELASTIC, TYPE=" + printable(type) + " is not supported; write TYPE=ISOTROPIC");
  }
  DraftMaterial& material = material_without_law(lexer, keyword, draft);
  const Constants constants = read_constants(lexer, keyword, 2, 2, "Young's modulus, Poisson's ratio");
  const double E = constants.values[0];
  const double nu = constants.values[1];
  if (E <= 0) lexer.fail(constants.place, "Young's modulus must be above 0; correct it");
  if (nu <= -1 || nu >= 0.5)
    lexer.fail(constants.place, "Poisson's ratio must lie above -1 and below 0.5; correct it");
  // A step with NLGEOM changes this small-strain law to St. Venant-Kirchhoff (inp_resolve.cpp).
  material.material.law = LinearElastic{E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))};
  material.has_law = true;
}

void read_solid_section(InpLexer& lexer, const KeywordLine& keyword, Draft& draft) {
  // All laws are isotropic, so that axes of the material change nothing.
  allow_parameters(lexer, keyword, draft, {"ELSET", "MATERIAL", "MEANDILATATION"}, {"ORIENTATION"});
  DraftSection section;
  section.element_set = known_set(lexer, draft.element_sets, "element set",
                                  lexer.required_value(keyword, "ELSET"), keyword.place);
  section.material = normalised_name(lexer.required_value(keyword, "MATERIAL"));
  const Parameter* mean_dilatation = keyword.find("MEANDILATATION");
  section.mean_dilatation = mean_dilatation != nullptr;
  if (section.mean_dilatation && mean_dilatation->value)
    lexer.fail(keyword.place, "MEAN DILATATION takes no value; write *SOLID SECTION, ..., MEAN DILATATION");
  section.place = keyword.place;
  draft.sections.push_back(section);
  if (const DataLine* line = lexer.next_data()) {
    // Abaqus/CAE writes an empty line or the attribute 1; both are meaningless for a solid.
    const FieldReader fields(lexer, *line, 1, 1, "nothing or 1");
    if (fields.number(0, 1.0) != 1.0) {
      lexer.fail(line->place,
                 "section attribute " + printable(line->text) + " is not supported; remove the line");
    }
  }
}

}  // namespace palpate
