// palpate_mesher: fills a closed surface with tetrahedra. `palpate mesh` runs it.
#include <CGAL/assertions_behaviour.h>
#include <CGAL/exceptions.h>
#include <fmt/core.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/finished_file.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/model_from_mesh.hpp"
#include "offline/io/organ_check.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesher/closed_surface.hpp"
#include "offline/mesher/size_field.hpp"
#include "offline/mesher/solid_fill.hpp"
#include "offline/mesher/surface_repair.hpp"

namespace palpate {
namespace {

constexpr double kMostElements = 4e6;   // some 4 GB in the mesher; a solve takes more
constexpr double kSuggestedParts = 25;  // of the longest side, for a --size that is missing
// Above so many times the estimate, and a slack for coarse surfaces, the refinement has gone astray.
constexpr double kMostOverEstimate = 10;
constexpr double kSlackElements = 2e4;
constexpr double kElementsPerNode = 4;  // in a coarse mesh; 5 to 6 in a fine one

struct MeshArguments {
  std::filesystem::path in;
  std::filesystem::path out;
  double size = 0;
  std::vector<std::string> refinements;
};

// Tests the ending of OUT before long work.
void check_solid_format(const std::filesystem::path& out) {
  const auto takes_solids = [](const MeshFormat& format) {
    return format.write != nullptr && !format.is_surface;
  };
  const MeshFormat* chosen = find_format(out);
  if (chosen != nullptr && takes_solids(*chosen)) return;
  std::string known;
  for (const MeshFormat& format : mesh_formats()) {
    if (takes_solids(format)) known += (known.empty() ? "" : " ") + std::string(format.extensions);
  }
  throw std::runtime_error(out.string() + ": no tetrahedra are written with this ending; name one of " +
                           known);
}

void check_size(double size, const Eigen::Vector3d& sides, const std::string& file) {
  if (size > 0 && std::isfinite(size)) return;
  throw std::runtime_error(fmt::format(
      "--size is needed, a number above 0, the length of an edge at the surface: {} measures {:.4g} x {:.4g} "
      "x {:.4g}, so try --size {:.2g}",
      file, sides[0], sides[1], sides[2], sides.maxCoeff() / kSuggestedParts));
}

// The least --size that leaves the number of elements below the limit, beside `num_refined` of the places.
double least_size(double size, double longest, double num_refined, const ClosedSurface& closed) {
  const auto is_enough = [&](double candidate) {
    const double num_plain = SizeField(candidate, {}, {}).num_elements(closed.area, closed.volume);
    return num_plain + num_refined <= kMostElements;
  };
  double least = std::max(size, 1e-6 * longest);
  while (!is_enough(least)) least *= 1.05;
  return 1.05 * least;  // as the message rounds
}

void check_number(const SizeField& sizes, double longest, const ClosedSurface& closed) {
  const double num_elements = sizes.num_elements(closed.area, closed.volume);
  if (num_elements <= kMostElements) return;
  const double num_plain = SizeField(sizes.size(), {}, {}).num_elements(closed.area, closed.volume);
  const double num_refined = num_elements - num_plain;
  if (num_plain <= kMostElements && num_refined > std::min(num_plain, kMostElements / 2))
    throw std::runtime_error(fmt::format(
        "--refine adds about {:.2g} tetrahedra to {:.2g}, and {:.2g} is the most; make its size larger, or "
        "its radius or set smaller",
        num_refined, num_plain, kMostElements));
  const double beside = std::min(kMostElements / 2, num_refined);  // also where that is infinite, or NaN
  throw std::runtime_error(fmt::format(
      "--size {:g} gives about {:.2g} tetrahedra, more than {:.2g}; take {:.2g} or more, and --refine for "
      "small places",
      sizes.size(), num_elements, kMostElements, least_size(sizes.size(), longest, beside, closed)));
}

void print_remarks(const std::vector<std::string>& remarks) {
  for (const std::string& remark : remarks) fmt::print("mended     {}\n", remark);
}

std::string counted(int count, const char* one, const char* several) {
  return fmt::format("{} {}", count, count == 1 ? one : several);
}

// Says how much of the volume the mesh has. The distance between the surfaces grows with the size, and so
// does the loss.
void print_volume(double volume, double closed_volume, double size) {
  constexpr double kMostLoss = 0.01;
  fmt::print("volume     {:.5g}, which is {:.2f} % of the volume inside the surface\n", volume,
             100 * volume / closed_volume);
  const double loss = std::abs(1 - volume / closed_volume);
  if (loss > kMostLoss)
    fmt::print(
        "warning    the volume differs by {:.2g} %, for edges are long beside the solid; take --size "
        "{:.2g}\n",
        100 * loss, size * kMostLoss / loss);
}

void print_result(const FilledSolid& solid, const ClosedSurface& closed, const MeshArguments& arguments,
                  double seconds) {
  const OrganCheck check = check_organ(model_from_mesh(solid.mesh), {});
  fmt::print("wrote      {}: {} nodes, {} tetrahedra, in {:.1f} s\n", arguments.out.string(),
             solid.mesh.positions.size(), solid.mesh.cells.size(), seconds);
  print_volume(check.volume, closed.volume, arguments.size);
  fmt::print("angles     between faces: {:.3g} to {:.3g} degrees\n", check.least_angle, check.largest_angle);
  fmt::print("surface    within {:.3g} of the input, {:.2g} of --size\n", solid.deviation,
             solid.deviation / arguments.size);
  for (const std::string& fault : check.faults) fmt::print("refused    {}\n", fault);
  if (check.num_open_edges > 0)
    fmt::print(
        "joints     {} edges at which parts touch that should not; a smaller --size may keep them apart\n",
        check.num_open_edges);
  if (solid.sharp_length > 0)
    fmt::print("edges      follows sharp edges of length {:.4g}\n", solid.sharp_length);
  fmt::print("\nNext:\n  palpate new {}\n", arguments.out.string());
}

// Throws CGAL's error as one line. Its what() has several lines, and its message() may have several.
[[noreturn]] void refuse(const CGAL::Failure_exception& error, const std::string& file) {
  const std::string message = error.message().substr(0, error.message().find('\n'));
  const std::string reason = message.empty() ? "" : " (CGAL: " + message + ")";
  throw InputError({file, 0}, "cannot be meshed" + reason +
                                  "; remesh the surface, for instance in MeshLab, or change --size");
}

// Lets CGAL throw its errors and warnings, and prints nothing before.
void prepare_cgal() {
  const auto ignore = [](const char*, const char*, const char*, int, const char*) {};
  CGAL::set_error_handler(ignore);
  CGAL::set_warning_handler(ignore);
  CGAL::set_warning_behaviour(CGAL::THROW_EXCEPTION);
}

void say_that_cgal_crashed(int /*signal*/) {
  constexpr std::string_view kMessage =
      "palpate mesh: CGAL crashed on this surface; remesh it, for instance in MeshLab, or change --size\n";
  std::_Exit(write(STDERR_FILENO, kMessage.data(), kMessage.size()) > 0 ? 1 : 2);
}

void handle_crashes(void (*handler)(int)) {
  for (const int signal : {SIGFPE, SIGSEGV, SIGABRT}) std::signal(signal, handler);
}

void run_mesh(const MeshArguments& arguments) try {
  prepare_cgal();
  const auto start = std::chrono::steady_clock::now();
  check_keeps_inputs(arguments.out, {arguments.in});
  check_solid_format(arguments.out);
  check_can_finish(arguments.out);
  check_replaces_mesh(arguments.out);
  const MeshData input = read_mesh(arguments.in);
  for (const std::string& note : input.notes) fmt::print(stderr, "{}\n", note);
  const std::string file = arguments.in.string();
  RepairedSurface repaired = repair_surface(surface_triangles(input, arguments.in), file);
  const Eigen::Vector3d sides = box_of(repaired.surface).sizes();
  check_size(arguments.size, sides, file);
  const SizeField sizes(arguments.size, arguments.refinements, input);
  handle_crashes(say_that_cgal_crashed);  // of CGAL alone: other crashes must not look like CGAL's
  const ClosedSurface closed = close_surface(repaired.surface, arguments.size, file);
  const double num_elements = sizes.num_elements(closed.area, closed.volume);
  check_number(sizes, sides.maxCoeff(), closed);

  fmt::print("surface    {}: {} triangles, {:.4g} x {:.4g} x {:.4g}\n", file, closed.surface.triangles.size(),
             sides[0], sides[1], sides[2]);
  print_remarks(repaired.remarks);
  print_remarks(closed.remarks);
  fmt::print("solid      {}{}, volume {:.5g}\n", counted(closed.num_parts, "part", "parts"),
             closed.num_cavities > 0 ? " with " + counted(closed.num_cavities, "cavity", "cavities") : "",
             closed.volume);
  fmt::print("meshing    about {:.2g} tetrahedra, edges of {:g} at the surface\n", num_elements,
             arguments.size);
  std::fflush(stdout);
  const double most_elements = std::min(kMostOverEstimate * num_elements + kSlackElements, kMostElements);
  const auto most_nodes = static_cast<std::size_t>(most_elements / kElementsPerNode);
  FilledSolid solid = fill_solid(closed, sizes, most_nodes, file);
  handle_crashes(SIG_DFL);
  solid.mesh.file = arguments.out.string();
  write_mesh(solid.mesh, {}, arguments.out);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  print_result(solid, closed, arguments, took.count());
} catch (const CGAL::Failure_exception& error) {
  refuse(error, arguments.in.string());
}

int run(int argc, char** argv) {
  CLI::App app{"Fill a closed surface with tetrahedra", "palpate mesh"};
  MeshArguments arguments;
  app.footer(
      "The surface: triangles of an STL, OBJ or PLY file, or of any mesh that `palpate convert` reads. "
      "Lengths are\n"
      "numbers of the file. Equal points are welded, triangles turned alike, and holes closed up to 10 sizes "
      "around,\n"
      "and no more than the diagonal of the surface.\n"
      "A surface inside another bounds a cavity. Edges grow to 2.5 sizes at the core of the solid.\n\n"
      "Places for --refine, which have finer elements than --size:\n"
      "  \"x,y,z,r: size\"       a ball\n"
      "  \"SET: size\"           a set of the mesh, a group of OBJ, a solid of a text STL\n\n"
      "Example: palpate mesh liver.stl --size 6 --refine \"12,80,45,15: 2\" -o liver.vtu\n"
      "         palpate new liver.vtu --tissue liver");
  app.add_option("IN", arguments.in, "File with a closed surface")->type_name("")->required();
  app.add_option("-o,--output", arguments.out, "Mesh to write: .vtu, .vtk, .msh, .inp, ...")
      ->type_name("OUT")
      ->required();
  app.add_option("--size", arguments.size, "Length of an edge at the surface")->type_name("S");
  app.add_option("--refine", arguments.refinements,
                 "A finer place, such as where tools touch; may be repeated")
      ->type_name("PLACE")
      ->expected(1)
      ->take_all();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help
    fmt::print(stderr, "palpate mesh: {}; see 'palpate mesh --help'\n", error.what());
    return 1;
  }
  run_mesh(arguments);
  return 0;
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  try {
    const int exit_code = palpate::run(argc, argv);
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return exit_code;
    fmt::print(stderr, "standard output: cannot be written\n");
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "palpate mesh: out of memory; take a larger --size\n");
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
  }
  return 1;
}
