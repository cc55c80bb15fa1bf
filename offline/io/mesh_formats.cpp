#include "offline/io/mesh_formats.hpp"

#include <array>
#include <stdexcept>

#include "offline/io/inp_format.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

template <MeshData (*Read)(FileCursor& in)>
MeshData read_file(const std::filesystem::path& file) {
  FileCursor in(file);
  return Read(in);
}

// `file`: either of TetGen's two files; the other stands beside it.
MeshData read_tetgen_files(const std::filesystem::path& file) {
  FileCursor nodes(std::filesystem::path(file).replace_extension(".node"));
  FileCursor elements(std::filesystem::path(file).replace_extension(".ele"));
  return read_tetgen(nodes, elements);
}

constexpr std::array kFormats = {
    MeshFormat{"Abaqus", ".inp", read_inp_mesh_file, write_inp_mesh},
    MeshFormat{"Gmsh", ".msh .msh1 .msh2 .msh4", read_file<read_gmsh>, write_gmsh, false, true},
    MeshFormat{"Medit", ".mesh", read_file<read_medit>, write_medit},
    MeshFormat{"TetGen", ".node .ele", read_tetgen_files, write_tetgen, false, true},
    MeshFormat{"VTK", ".vtk", read_file<read_vtk>, write_vtk, false, true},
    MeshFormat{"VTU", ".vtu", read_file<read_vtu>, write_vtu, false, true},
    MeshFormat{"STL", ".stl", read_file<read_stl>, write_stl, true},
    MeshFormat{"OBJ", ".obj", read_file<read_obj>, write_obj, true},
    MeshFormat{"PLY", ".ply", read_file<read_ply>, write_ply, true},
};

std::string known_extensions(bool for_writing) {
  std::string all;
  for (const MeshFormat& format : mesh_formats()) {
    if (!for_writing || format.write != nullptr)
      all += (all.empty() ? "" : " ") + std::string(format.extensions);
  }
  return all;
}

}  // namespace

std::span<const MeshFormat> mesh_formats() {
  return kFormats;
}

const MeshFormat* find_format(const std::filesystem::path& file) {
  const std::string extension = lower_case(file.extension().string());
  for (const MeshFormat& format : mesh_formats()) {
    const std::string all = std::string(format.extensions) + " ";
    if (!extension.empty() && all.find(extension + " ") != std::string::npos) return &format;
  }
  return nullptr;
}

MeshData read_mesh(const std::filesystem::path& file) {
  const MeshFormat* format = find_format(file);
  if (format == nullptr)
    throw InputError({file.string(), 0},
                     "has no ending of a mesh format; known are " + known_extensions(false));
  return format->read(file);
}

void check_replaces_mesh(const std::filesystem::path& file) {
  const MeshFormat* format = find_format(file);
  std::error_code absent;
  if (format == nullptr || !std::filesystem::is_regular_file(file, absent) ||
      std::filesystem::file_size(file, absent) == 0)
    return;
  try {
    format->read(file);
  } catch (const std::runtime_error&) {
    throw std::runtime_error(file.string() + ": exists, and cannot be read as " + format->name +
                             "; remove it, or name another place");
  }
}

void write_mesh(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file) {
  const MeshFormat* format = find_format(file);
  if (format == nullptr || format->write == nullptr)
    throw std::runtime_error(file.string() + ": no mesh is written with this ending; name one of " +
                             known_extensions(true));
  format->write(mesh, options, file);
}

}  // namespace palpate
