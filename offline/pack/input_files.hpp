// Reads the input files that a pack carries, and restores these files to solve the organ again.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "schemas/pack_generated.h"

namespace palpate {

struct InputFile {
  std::string path;  // relative to the nearest common folder of all inputs, with /
  std::string hash;  // XXH3-128 of the contents, in hexadecimal
  std::string contents;
};

// Reads and hashes the files. Throws std::runtime_error "PATH: REASON" when a file cannot be read.
std::vector<InputFile> read_inputs(const std::vector<std::filesystem::path>& files);

// Writes the inputs of an open pack below `folder` and returns the path of the scene, the first input. Throws
// std::runtime_error where the pack carries no inputs or altered ones.
std::filesystem::path write_inputs(const pack::Pack& tables, std::span<const unsigned char> pack,
                                   const std::filesystem::path& folder);

}  // namespace palpate
