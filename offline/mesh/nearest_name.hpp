// Suggests a known name for a misspelt name.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace palpate {

// Returns "; did you mean PROBE?", or `otherwise` where no name in `known` is near.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& known,
                         std::string_view otherwise = {});

}  // namespace palpate
