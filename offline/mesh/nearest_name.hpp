// "did you mean ...": the known name that a misspelt one was probably meant to be.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace palpate {

// The name in `known` that `name` becomes with the fewest letters inserted, left out or replaced, upper and
// lower case alike; the first of equals. Empty when even the nearest needs more than a third of the letters
// changed.
std::string nearest_name(std::string_view name, const std::vector<std::string>& known);

// "; did you mean PROBE?", or nothing when no name is near.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& known);

}  // namespace palpate
