// Pieces of HTML.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace palpate {

// With &, <, > and " spelled out.
std::string html_escaped(std::string_view text);

// "data:TYPE;base64,...": a file as part of the page. Throws std::runtime_error "PATH: cannot be read".
std::string data_uri(const std::filesystem::path& file, const char* type);

}  // namespace palpate
