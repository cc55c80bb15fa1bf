// Says of keywords and parameters that are not supported what they do and what to write instead. "Remove it"
// is no remedy where the result changes.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "offline/mesh/inp_lexer.hpp"

namespace palpate {

// Returns the remedy for a keyword. `known`: the supported keywords, of which a misspelt name may mean one.
std::string keyword_remedy(const KeywordLine& keyword, std::span<const std::string> known);

// Returns the remedy for a parameter of a supported keyword, whose supported parameters are `known`.
std::string parameter_remedy(const KeywordLine& keyword, const Parameter& parameter,
                             std::span<const std::string_view> known);

}  // namespace palpate
