// Formats pieces of HTML.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

// Escapes &, <, > and ".
std::string html_escaped(std::string_view text);

// Formats a table; the first row holds the headings.
std::string html_table(const std::vector<std::vector<std::string>>& rows);

// Embeds a file as "data:TYPE;base64,...". Throws std::runtime_error "PATH: cannot be read".
std::string data_uri(const std::filesystem::path& file, const char* type);

}  // namespace palpate
