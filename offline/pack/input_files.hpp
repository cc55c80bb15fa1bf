// The files that a pack was made from, which it carries, so that whoever has it can solve the same organ again.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "schemas/pack_generated.h"

namespace palpate {

struct InputFile {
  std::string path;  // from the nearest folder that holds all inputs, with /
  std::string hash;  // XXH3-128 of the contents, in hexadecimal
  std::string contents;
};

// Throws std::runtime_error "PATH: REASON" when one cannot be read.
std::vector<InputFile> read_inputs(const std::vector<std::filesystem::path>& files);

// Writes the inputs of an open pack below `folder` and returns the first of them, the scene. Throws
// std::runtime_error where the pack carries none, or what it carries is not what it was made from.
std::filesystem::path write_inputs(const pack::Pack& tables, std::span<const unsigned char> pack,
                                   const std::filesystem::path& folder);

}  // namespace palpate
