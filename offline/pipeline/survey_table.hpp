// Tables of errors, as `build`, `info` and `validate` print them.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/set_survey.hpp"
#include "schemas/pack_generated.h"

namespace palpate {

struct ModelErrors {
  std::string model;  // "linear_dd", ...
  pal_model runtime_model;
  SurveyTable table;
  SetSurvey sets = {};
};

// What a pack says of itself.
std::vector<ModelErrors> surveys_of(const pack::Pack& tables);

// A text table: a row for each model and bin of |d|, median / p95 / max of displacement and force error in
// percent.
std::string survey_text(const std::vector<ModelErrors>& surveys);

// The same of sets of several contacts, a row for each model and kind of set; "" where there are none.
std::string set_survey_text(const std::vector<ModelErrors>& surveys);

nlohmann::json survey_json(const SurveyTable& table);
nlohmann::json set_survey_json(const SetSurvey& sets);                // a list, by kind
nlohmann::json survey_json(const std::vector<ModelErrors>& surveys);  // by model

// How linear_dd keeps the compliance, and what that costs; null without the model.
nlohmann::json compliance_json(const pack::Pack& tables);

}  // namespace palpate
