// Reads an organ from any mesh format for `palpate check` and `palpate new`.
#pragma once

#include <filesystem>

#include "offline/mesh/model.hpp"

namespace palpate {

// The tetrahedra of a mesh file, with positions times `scale`. Prints the reader's notes on stderr.
Model read_organ(const std::filesystem::path& file, double scale);

}  // namespace palpate
