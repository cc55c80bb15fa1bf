// The mesh formats by name and ending. Each format has a file of its own: `gmsh_format`, `vtk_format`, ...
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "offline/io/mesh_data.hpp"

namespace palpate {

// How a file is written. Formats without the choice ignore it.
struct WriteOptions {
  bool is_binary = true;
};

struct MeshFormat {
  const char* name;        // "Gmsh", for messages
  const char* extensions;  // ".msh", or several: ".node .ele"
  MeshData (*read)(const std::filesystem::path& file);
  // Null where the format is only read.
  void (*write)(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);
};

std::span<const MeshFormat> mesh_formats();

// Reads a mesh by the ending of its name. Throws InputError, one line with file, line and remedy.
MeshData read_mesh(const std::filesystem::path& file);

// Writes a mesh by the ending of the name. Throws std::runtime_error with a remedy.
void write_mesh(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);

}  // namespace palpate
