// Writes the bytes of a mesh file.
#pragma once

#include <filesystem>
#include <string_view>

namespace palpate {

// Throws std::runtime_error "PATH: REASON; REMEDY".
void write_output_file(const std::filesystem::path& file, std::string_view bytes);

}  // namespace palpate
