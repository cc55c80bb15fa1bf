// Formats JSON for every command.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace palpate {

// Formats with an indent of 2. A byte that is not UTF-8 becomes U+FFFD, a number that is not finite null.
inline std::string json_text(const nlohmann::json& json) {
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace palpate
