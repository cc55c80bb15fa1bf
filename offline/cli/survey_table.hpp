// The error table of a pack, as `build` and `info` print it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "schemas/pack_generated.h"

namespace palpate {

// A text table: a row for each model and bin of |d|, median / p95 / max of displacement and force error in
// percent.
std::string survey_text(const pack::Pack& tables);

nlohmann::json survey_json(const pack::Pack& tables);

// How linear_dd keeps the compliance, and what that costs; null without the model.
nlohmann::json compliance_json(const pack::Pack& tables);

}  // namespace palpate
