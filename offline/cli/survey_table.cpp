#include "offline/cli/survey_table.hpp"

#include <fmt/core.h>

namespace palpate {
namespace {

std::string row_text(const char* model, const pack::ErrorBin& bin, const char* range) {
  if (bin.samples() == 0) return fmt::format("  {:<14} {:<12} {:>7}   not measured\n", model, range, 0);
  return fmt::format("  {:<14} {:<12} {:>7}   {:8.4f} {:8.4f} {:8.4f}   {:8.4f} {:8.4f} {:8.4f}\n", model,
                     range, bin.samples(), 100 * bin.displacement_median(), 100 * bin.displacement_p95(),
                     100 * bin.displacement_max(), 100 * bin.force_median(), 100 * bin.force_p95(),
                     100 * bin.force_max());
}

nlohmann::json row_json(const pack::ErrorBin& bin) {
  return {{"from", bin.from()},
          {"to", bin.to()},
          {"samples", bin.samples()},
          {"displacement",
           {{"median", bin.displacement_median()},
            {"p95", bin.displacement_p95()},
            {"max", bin.displacement_max()}}},
          {"force", {{"median", bin.force_median()}, {"p95", bin.force_p95()}, {"max", bin.force_max()}}}};
}

}  // namespace

std::string survey_text(const pack::Pack& tables) {
  std::string text =
      "Errors against full nonlinear solves at held-out random displacements, percent\n"
      "                 |d| / max                    displacement                     force\n"
      "  model          displacement samples     median      p95      max     median      p95      max\n";
  for (const pack::ErrorSurvey* survey : *tables.surveys()) {
    const char* model = pack::EnumNameResponseModel(survey->model());
    for (const pack::ErrorBin* bin : *survey->bins()) {
      text += row_text(model, *bin, fmt::format("{:.2f}-{:.2f}", bin->from(), bin->to()).c_str());
    }
    text += row_text(model, *survey->overall(), "all");
  }
  return text;
}

nlohmann::json survey_json(const pack::Pack& tables) {
  nlohmann::json surveys = nlohmann::json::object();
  for (const pack::ErrorSurvey* survey : *tables.surveys()) {
    nlohmann::json bins = nlohmann::json::array();
    for (const pack::ErrorBin* bin : *survey->bins()) bins.push_back(row_json(*bin));
    surveys[pack::EnumNameResponseModel(survey->model())] = {{"bins", bins},
                                                             {"overall", row_json(*survey->overall())}};
  }
  return surveys;
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
