// Reads a whole text file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace palpate {

// Largest model in bytes. A line takes about 50 bytes, so a model may have twenty million nodes and elements.
inline constexpr std::size_t kMaxModelBytes = std::size_t{1} << 30;
// Largest scene in bytes. People write scenes by hand; the shipped scenes take a few KiB.
inline constexpr std::size_t kMaxSceneBytes = std::size_t{1} << 20;

// Reads `file` into `content`. Returns "", or the reason of a failure with the remedy:
// "cannot be read (No such file or directory); check its name".
std::string read_text_file(const std::filesystem::path& file, std::string& content,
                           std::size_t max_bytes = kMaxModelBytes);

}  // namespace palpate
