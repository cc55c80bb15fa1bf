// Reads a whole text file.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

// Reads `file` into `content`. Returns "", or the failure with its remedy: "cannot be read (No such file or
// directory); check its name".
std::string read_text_file(const std::filesystem::path& file, std::string& content);

}  // namespace palpate
