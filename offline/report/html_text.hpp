// Pieces of HTML.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

// With &, <, > and " spelled out.
std::string html_escaped(std::string_view text);

// A table, its first row the headings.
std::string html_table(const std::vector<std::vector<std::string>>& rows);

// "data:TYPE;base64,...": a file as part of the page. Throws std::runtime_error "PATH: cannot be read".
std::string data_uri(const std::filesystem::path& file, const char* type);

}  // namespace palpate
