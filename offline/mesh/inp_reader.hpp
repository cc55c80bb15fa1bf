// Abaqus-style .inp files: the subset in which an organ is described, with Abaqus' own meaning.
#pragma once

#include <filesystem>

#include "offline/mesh/model.hpp"

namespace palpate {

// Reads and checks a model.
//
// Keywords (any case, spaces free, continuation by a trailing comma on a keyword line): *HEADING, *INCLUDE,
// *NODE, *ELEMENT (TYPE=C3D4, C3D10), *NSET, *ELSET (both with GENERATE, and naming other sets), *MATERIAL,
// *HYPERELASTIC, *ELASTIC, *SOLID SECTION, *BOUNDARY, *STEP (NLGEOM, INC),
// *STATIC, *CLOAD, *NODE PRINT, *NODE FILE, *EL FILE (these three are passed over with a warning), *END STEP,
// and ** comments. Anything else is refused by name and line.
//
// Throws InputError, one line with file, line and remedy. Cost: linear in the file, memory a few times its
// size.
Model read_inp(const std::filesystem::path& file);

}  // namespace palpate
