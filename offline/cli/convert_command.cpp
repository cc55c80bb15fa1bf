// palpate convert: a mesh from one file format to another.
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <filesystem>
#include <memory>

#include "offline/cli/commands.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/mesh_split.hpp"
#include "offline/io/surface_cells.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

struct ConvertArguments {
  std::filesystem::path in;
  std::filesystem::path out;
  bool split = false;
  bool text = false;
};

void run_convert(const ConvertArguments& arguments) {
  check_keeps_inputs(arguments.out, {arguments.in});
  check_replaces_mesh(arguments.out);
  MeshData mesh = read_mesh(arguments.in);
  for (const std::string& note : mesh.notes) fmt::print(stderr, "{}\n", note);
  if (arguments.split) {
    const size_t cells = split_into_tetrahedra(mesh);
    fmt::print("split      {} cells into tetrahedra\n", cells);
  }
  write_mesh(mesh, {!arguments.text}, arguments.out);
  const MeshFormat& format = *find_format(arguments.out);
  if (!format.has_arrays) {
    for (const auto* arrays : {&mesh.point_arrays, &mesh.cell_arrays}) {
      for (const MeshArray& array : *arrays)
        fmt::print(stderr, "{}: the array '{}' is left out; Gmsh, TetGen, VTK and VTU keep arrays\n",
                   arguments.out.string(), printable(array.name));
    }
  }
  if (format.is_surface) {
    const SurfaceTriangles surface = surface_triangles(mesh, arguments.out);
    fmt::print("wrote      {}: {} nodes, {} triangles\n", arguments.out.string(), surface.positions.size(),
               surface.triangles.size());
    return;
  }
  fmt::print("wrote      {}: {} nodes, {} cells, {} node sets, {} element sets\n", arguments.out.string(),
             mesh.positions.size(), mesh.cells.size(), mesh.node_sets.size(), mesh.element_sets.size());
}

}  // namespace

void add_convert_command(CLI::App& app) {
  auto arguments = std::make_shared<ConvertArguments>();
  CLI::App* command = app.add_subcommand("convert", "Convert a mesh between file formats");
  std::string formats;
  for (const MeshFormat& format : mesh_formats())
    formats += fmt::format("{}{} ({})", formats.empty() ? "" : ", ", format.name, format.extensions);
  command->footer("The endings of the names choose the formats: " + formats +
                  ".\nSets go along as physical groups, as references, or in VTK as arrays \"set:NAME\".\n\n"
                  "Example: palpate convert liver.vtk liver.inp\n"
                  "         palpate convert --split hexahedra.msh tetrahedra.vtu");
  command->add_option("IN", arguments->in, "Mesh file to read")->type_name("")->required();
  command->add_option("OUT", arguments->out, "Mesh file to write")->type_name("")->required();
  command->add_flag("--split", arguments->split, "Split hexahedra, wedges and pyramids into tetrahedra");
  command->add_flag("--text", arguments->text, "Write text where the format also has a binary form");
  command->callback([arguments] { run_convert(*arguments); });
}

}  // namespace palpate
