// Suggests a known name for a misspelt name.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace palpate {

// Returns the name in `known` with the fewest letter changes from `name`, ignoring case; the first of equals.
// Empty where more than a third of the letters differ.
std::string nearest_name(std::string_view name, const std::vector<std::string>& known);

// "; did you mean PROBE?", or "" where no name is near.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& known);

}  // namespace palpate
