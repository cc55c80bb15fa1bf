// A whole text file in memory.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

// Reads `file` into `content`. Returns "" or the reason why it could not, with the remedy:
// "cannot be read (No such file or directory); check its name".
std::string read_text_file(const std::filesystem::path& file, std::string& content);

}  // namespace palpate
