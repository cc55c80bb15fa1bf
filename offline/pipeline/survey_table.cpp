#include "offline/pipeline/survey_table.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

namespace palpate {
namespace {

std::string row_text(const std::string& model, const SurveyBin& bin, const std::string& range) {
  if (bin.samples == 0) return fmt::format("  {:<14} {:<12} {:>7}   not measured\n", model, range, 0);
  return fmt::format("  {:<14} {:<12} {:>7}   {:8.4f} {:8.4f} {:8.4f}   {:8.4f} {:8.4f} {:8.4f}\n", model,
                     range, bin.samples, 100 * bin.displacement.median, 100 * bin.displacement.p95,
                     100 * bin.displacement.max, 100 * bin.force.median, 100 * bin.force.p95,
                     100 * bin.force.max);
}

nlohmann::json figures_json(const ErrorFigures& figures, bool measured) {
  if (!measured) return nullptr;
  return {{"median", figures.median},
          {"p95", figures.p95},
          {"max", figures.max},
          {"bound", figures.bound},
          {"growth", figures.growth}};
}

nlohmann::json row_json(const SurveyBin& bin) {
  return {{"from", bin.from},
          {"to", bin.to},
          {"samples", bin.samples},
          {"displacement", figures_json(bin.displacement, bin.samples > 0)},
          {"force", figures_json(bin.force, bin.samples > 0)}};
}

SurveyBin bin_of(const pack::ErrorBin& bin) {
  return {bin.from(),
          bin.to(),
          static_cast<int>(bin.samples()),
          {bin.displacement_median(), bin.displacement_p95(), bin.displacement_max(),
           bin.displacement_bound(), bin.displacement_growth()},
          {bin.force_median(), bin.force_p95(), bin.force_max(), bin.force_bound(), bin.force_growth()}};
}

SetSurvey sets_of(const pack::ErrorSurvey& survey) {
  SetSurvey sets;
  if (survey.sets() == nullptr) return sets;
  for (const pack::SetErrors* errors : *survey.sets()) {
    for (const SetKind kind : kSetKinds) {
      if (static_cast<std::uint32_t>(num_contacts_of(kind)) != errors->contacts() ||
          is_near(kind) != (errors->near() != 0))
        continue;
      sets.kinds.push_back(
          {kind,
           static_cast<int>(errors->sets()),
           static_cast<int>(errors->unsolved()),
           static_cast<int>(errors->flagged()),
           {errors->displacement_median(), errors->displacement_p95(), errors->displacement_max(), 0},
           {errors->force_median(), errors->force_p95(), errors->force_max(), 0}});
    }
  }
  return sets;
}

}  // namespace

std::vector<ModelErrors> surveys_of(const pack::Pack& tables) {
  std::vector<ModelErrors> surveys;
  for (const pack::ErrorSurvey* survey : *tables.surveys()) {
    if (survey->model() > pack::ResponseModel::MAX) continue;  // skip models of later builders
    ModelErrors errors = {pack::EnumNameResponseModel(survey->model()),
                          runtime_model(survey->model()),
                          survey->model() != pack::ResponseModel::unrefined_zone,
                          {},
                          sets_of(*survey)};
    for (unsigned i = 0; i < std::min(survey->bins()->size(), pack::kSurveyBins); ++i)
      errors.table.bins[i] = bin_of(*survey->bins()->Get(i));
    errors.table.overall = bin_of(*survey->overall());
    surveys.push_back(std::move(errors));
  }
  return surveys;
}

std::string survey_text(const std::vector<ModelErrors>& surveys) {
  std::string text =
      "Errors against full nonlinear solves at held-out random displacements, percent\n"
      "                 |d| / max                    displacement                     force\n"
      "  model          displacement samples     median      p95      max     median      p95      max\n";
  for (const ModelErrors& survey : surveys) {
    for (const SurveyBin& bin : survey.table.bins)
      text += row_text(survey.model, bin, fmt::format("{:.2f}-{:.2f}", bin.from, bin.to));
    text += row_text(survey.model, survey.table.overall, "all");
  }
  return text;
}

std::string set_survey_text(const std::vector<ModelErrors>& surveys) {
  std::string text;
  for (const ModelErrors& survey : surveys) {
    for (const SetKindErrors& kind : survey.sets.kinds) {
      text += fmt::format(
          "  {:<14} {:<10} {:>4} {:>8} {:>8}   {:8.4f} {:8.4f} {:8.4f}   {:8.4f} {:8.4f} {:8.4f}\n",
          survey.model, words_for(kind.kind), kind.sets, kind.flagged, kind.unsolved,
          100 * kind.displacement.median, 100 * kind.displacement.p95, 100 * kind.displacement.max,
          100 * kind.force.median, 100 * kind.force.p95, 100 * kind.force.max);
    }
  }
  if (text.empty()) return text;
  return "Errors of several contacts at once, each pushed at random as far as the scene goes, percent\n"
         "                                     no equi-            displacement                     force\n"
         "  model          contacts   sets  flagged librium     median      p95      max     median      p95 "
         "     "
         "max\n" +
         text;
}

nlohmann::json set_survey_json(const SetSurvey& sets) {
  nlohmann::json json = nlohmann::json::array();
  for (const SetKindErrors& kind : sets.kinds) {
    const auto figures = [](const ErrorFigures& errors) -> nlohmann::json {
      return {{"median", errors.median}, {"p95", errors.p95}, {"max", errors.max}};
    };
    json.push_back({{"contacts", num_contacts_of(kind.kind)},
                    {"near", is_near(kind.kind)},
                    {"sets", kind.sets},
                    {"flagged", kind.flagged},
                    {"without_equilibrium", kind.unsolved},
                    {"displacement", figures(kind.displacement)},
                    {"force", figures(kind.force)}});
  }
  return json;
}

nlohmann::json survey_json(const SurveyTable& table) {
  nlohmann::json bins = nlohmann::json::array();
  for (const SurveyBin& bin : table.bins) bins.push_back(row_json(bin));
  return {{"bins", bins}, {"overall", row_json(table.overall)}};
}

nlohmann::json survey_json(const std::vector<ModelErrors>& surveys) {
  nlohmann::json json = nlohmann::json::object();
  for (const ModelErrors& survey : surveys) {
    json[survey.model] = survey_json(survey.table);
    if (!survey.sets.kinds.empty()) json[survey.model]["several"] = set_survey_json(survey.sets);
  }
  return json;
}

std::string motion_text(const std::vector<MotionErrors>& rows) {
  if (rows.empty()) return "";
  std::string text =
      "                                     displacement error, %        force error, %\n"
      "  in motion      contacts   lag frames    median      p95      max     median      p95      max     "
      "jump  "
      "unreliable\n";
  for (const MotionErrors& row : rows) {
    text += fmt::format(
        "  {:>4.0f} mm/s      {:>8} {:>2} ms {:>6}  {:8.4f} {:8.4f} {:8.4f}   {:8.4f} {:8.4f} {:8.4f} "
        "{:8.4f} "
        "{:>11}\n",
        1e3 * row.motion.speed, row.contacts, row.motion.lag, row.frames, 100 * row.displacement.median,
        100 * row.displacement.p95, 100 * row.displacement.max, 100 * row.force.median, 100 * row.force.p95,
        100 * row.force.max, 100 * row.largest_jump, row.flagged);
  }
  return text;
}

nlohmann::json motion_json(const std::vector<MotionErrors>& rows) {
  nlohmann::json list = nlohmann::json::array();
  const auto figures = [](const ErrorFigures& errors) {
    return nlohmann::json{{"median", errors.median}, {"p95", errors.p95}, {"max", errors.max}};
  };
  for (const MotionErrors& row : rows) {
    list.push_back({{"speed_mm_s", 1e3 * row.motion.speed},
                    {"lag_ms", row.motion.lag},
                    {"contacts", row.contacts},
                    {"frames", row.frames},
                    {"unreliable", row.flagged},
                    {"displacement", figures(row.displacement)},
                    {"force", figures(row.force)},
                    {"largest_jump", row.largest_jump}});
  }
  return list;
}

nlohmann::json compliance_json(const pack::Pack& tables) {
  if (tables.linear_dd() == nullptr) return nullptr;
  const pack::CompressedCompliance* compressed = tables.linear_dd()->compressed();
  if (compressed == nullptr) return {{"form", "dense"}};
  return {{"form", "compressed"},
          {"tolerance", compressed->tolerance()},
          {"samples", compressed->samples()},
          {"displacement_error", compressed->displacement_error()},
          {"force_error", compressed->force_error()}};
}

}  // namespace palpate
