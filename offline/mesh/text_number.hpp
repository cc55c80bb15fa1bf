// Numbers and names as they are written in model files.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace palpate {

// `text` without the blanks around it.
std::string_view trimmed(std::string_view text);

// The whole of `text` as a decimal number: "1.", "-.5", "1e-3", "1.0D0" (Fortran's exponent), "+5". Infinite
// and not-a-number texts are no numbers. Never depends on the locale.
std::optional<double> parse_number(std::string_view text);

// The whole of `text` as an integer, "+5" among them; "5." is not one.
std::optional<int> parse_integer(std::string_view text);

// A name as sets, materials and keywords are compared: upper case, blanks removed; what stands in double
// quotes is kept as it is, without the quotes.
std::string normalised_name(std::string_view text);

// `text` as it can stand in a one-line message: no control characters, and no longer than a name ought to be.
std::string printable(std::string_view text);

}  // namespace palpate
