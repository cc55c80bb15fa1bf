// Parses numbers and names of model files.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace palpate {

// Removes surrounding blanks.
std::string_view trimmed(std::string_view text);

// Parses all of `text` as a decimal number: "1.", "-.5", "1e-3", "1.0D0" (Fortran's exponent), "+5". Refuses
// infinity and not-a-number. Independent of the locale.
std::optional<double> parse_number(std::string_view text);

// Parses all of `text` as an integer, such as "+5"; refuses "5.".
std::optional<int> parse_integer(std::string_view text);

// Change the letters of ASCII alone.
std::string lower_case(std::string_view text);
std::string upper_case(std::string_view text);

// Removes double quotes around the text.
std::string unquoted(std::string_view text);

// Normalises a name: upper case, no blanks. A name in double quotes keeps its letters and loses the quotes.
std::string normalised_name(std::string_view text);

// Makes `text` fit a one-line message: no control characters, at most `longest` bytes.
std::string printable(std::string_view text, std::size_t longest = 60);

}  // namespace palpate
