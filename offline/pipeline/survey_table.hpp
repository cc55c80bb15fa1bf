// Formats the error tables of `build`, `info` and `validate`.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "offline/pipeline/motion_survey.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/set_survey.hpp"
#include "schemas/pack_generated.h"

namespace palpate {

struct ModelErrors {
  std::string model;  // "linear_dd", ...
  pal_model runtime_model;
  bool refines;  // false: nonlinear_zone, before the refining lane
  SurveyTable table;
  SetSurvey sets = {};
};

// Reads the surveys of a pack.
std::vector<ModelErrors> surveys_of(const pack::Pack& tables);

// Formats a row for each model and bin of |d|: median / p95 / max of displacement and force error in percent.
std::string survey_text(const std::vector<ModelErrors>& surveys);

// Formats a row for each model and kind of contact set; "" without sets.
std::string set_survey_text(const std::vector<ModelErrors>& surveys);

// Formats a row for each motion; "" without rows.
std::string motion_text(const std::vector<MotionErrors>& rows);

nlohmann::json survey_json(const SurveyTable& table);
nlohmann::json set_survey_json(const SetSurvey& sets);                // a list, by kind
nlohmann::json survey_json(const std::vector<ModelErrors>& surveys);  // by model

nlohmann::json motion_json(const std::vector<MotionErrors>& rows);  // a list, in order

// Storage and error of the compliance of linear_dd; null without the model.
nlohmann::json compliance_json(const pack::Pack& tables);

}  // namespace palpate
