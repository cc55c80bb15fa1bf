// Reads Abaqus-style .inp files: the subset for an organ, with Abaqus' own meaning.
#pragma once

#include <filesystem>

#include "offline/mesh/model.hpp"

namespace palpate {

// Reads and checks a model. keywords.md lists the supported keywords; any other keyword is refused by name
// and line. Throws InputError, a line with file, line and remedy for each refusal. Cost: linear in the file.
// All files must lie below `include_root`, links resolved; if empty, included files below the model's folder.
// Nodes closer than `merge_length` (length unit) are merged (merge_nodes.hpp).
Model read_inp(const std::filesystem::path& file, const std::filesystem::path& include_root = {},
               double merge_length = 0);

// Reads a model that may lack materials, sections and supports, for reports about the file. Elements
// without a section have the material -1. Neither the mesh nor its supports are checked.
Model read_inp_unchecked(const std::filesystem::path& file, double merge_length = 0);

// Reads nodes, elements and sets of a model, which may lack materials, supports and steps. The mesh is as
// in the file: elements may be inverted, and nodes without elements remain.
Model read_inp_mesh(const std::filesystem::path& file, const std::filesystem::path& include_root = {});

}  // namespace palpate
