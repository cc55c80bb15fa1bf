// The mesh formats by name and ending. A format's own file tells what it keeps: gmsh_reader.cpp,
// vtk_format.cpp, ...
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "offline/io/file_cursor.hpp"
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
  bool is_surface = false;  // holds triangles alone
  bool has_arrays = false;  // holds arrays of points and cells
};

std::span<const MeshFormat> mesh_formats();

// The format by the ending of a file's name, in letters of either case; null where none has the ending.
const MeshFormat* find_format(const std::filesystem::path& file);

// Reads a mesh by the ending of its name. Throws InputError, one line with file, line and remedy.
MeshData read_mesh(const std::filesystem::path& file);

// Throws std::runtime_error with a remedy where a file is there already that cannot be read by its ending: a
// file of something else, which a mesh must not replace. An empty file may be replaced.
void check_replaces_mesh(const std::filesystem::path& file);

// Writes a mesh by the ending of the name. Throws std::runtime_error with a remedy.
void write_mesh(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);

// Throw InputError.
MeshData read_gmsh(FileCursor& in);
MeshData read_medit(FileCursor& in);
MeshData read_vtk(FileCursor& in);
MeshData read_vtu(FileCursor& in);
MeshData read_stl(FileCursor& in);
MeshData read_obj(FileCursor& in);
MeshData read_ply(FileCursor& in);
MeshData read_tetgen(FileCursor& nodes, FileCursor& elements);

// Throw std::runtime_error where the format cannot hold the mesh.
void write_gmsh(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);
void write_medit(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);
void write_tetgen(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);
void write_vtk(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);
void write_vtu(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);
void write_stl(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);
void write_obj(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);
void write_ply(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);

}  // namespace palpate
