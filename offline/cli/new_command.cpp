// palpate new: a scene, and a model with a tissue and supports, for any mesh of an organ.
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "offline/cli/commands.hpp"
#include "offline/cli/organ_file.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/inp_format.hpp"
#include "offline/io/model_from_mesh.hpp"
#include "offline/io/node_selection.hpp"
#include "offline/io/tissue_table.hpp"
#include "offline/mesh/surface.hpp"

namespace palpate {
namespace {

constexpr const char* kLowestTenth = "z<10%";
constexpr const char* kFixedSet = "FIXED";
constexpr const char* kProbeSet = "PROBE";

// A length unit, the force unit for which moduli come out in numbers of ordinary size, and kPa in both.
struct Units {
  const char* length;
  const char* force;
  double kilopascal;
};
constexpr std::array kUnits = {Units{"mm", "mN", 1.0}, Units{"cm", "N", 0.1}, Units{"m", "N", 1000.0}};

struct NewArguments {
  std::filesystem::path mesh;
  std::filesystem::path folder = ".";
  std::string tissue = "liver";
  std::string unit = "mm";
  std::string fix;
  std::string probe;
  double scale = 1;
};

const Units& units_of(const std::string& length) {
  return *std::find_if(kUnits.begin(), kUnits.end(),
                       [&](const Units& units) { return length == units.length; });
}

const Tissue& tissue_of(const std::string& name) {
  return *std::find_if(kTissues.begin(), kTissues.end(),
                       [&](const Tissue& tissue) { return name == tissue.name; });
}

struct MarkedOrgan {
  Model model;    // with its sets FIXED and, if places to touch were named, PROBE
  bool is_guess;  // FIXED is the lowest tenth
};

MarkedOrgan marked_organ(const NewArguments& arguments) {
  Model model = read_organ(arguments.mesh, arguments.scale);
  const bool has_fixed = model.node_sets.contains(kFixedSet);
  const bool is_guess = arguments.fix.empty() && !has_fixed;
  model.node_sets[kFixedSet] = select_nodes(model,
                                            is_guess                ? kLowestTenth
                                            : arguments.fix.empty() ? kFixedSet
                                                                    : arguments.fix,
                                            "--fix");
  if (!arguments.probe.empty()) {
    const std::vector<int> chosen = select_nodes(model, arguments.probe, "--probe");
    const Surface surface = extract_surface(model);
    std::vector<int> touched;
    std::set_intersection(chosen.begin(), chosen.end(), surface.nodes.begin(), surface.nodes.end(),
                          std::back_inserter(touched));
    std::erase_if(touched, [&](int node) {
      const std::vector<int>& fixed = model.node_sets[kFixedSet];
      return std::binary_search(fixed.begin(), fixed.end(), node);
    });
    if (touched.empty())
      throw std::runtime_error("--probe '" + arguments.probe +
                               "': holds no free node of the surface; choose a larger place");
    model.node_sets[kProbeSet] = touched;
  }
  return {std::move(model), is_guess};
}

std::string model_text(const Model& model, const NewArguments& arguments, const Units& units) {
  const Tissue& tissue = tissue_of(arguments.tissue);
  const double mu = tissue.shear_modulus * units.kilopascal;
  const double lambda = 2 * mu * kTissueRatio / (1 - 2 * kTissueRatio);
  const bool is_linear = model.elements.front().num_nodes == 4;
  return fmt::format(
      "*HEADING\n{0}: {1}, shear modulus {2:g} kPa, Poisson's ratio {3:g}. Units: {4}, {5}.\n{6}"
      "*MATERIAL, NAME=TISSUE\n*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n{7:.6g}, {8:.6g}\n"
      "*SOLID SECTION, ELSET=ALL, MATERIAL=TISSUE{9}\n*BOUNDARY\n{10}, 1, 3\n",
      arguments.mesh.filename().string(), tissue.name, tissue.shear_modulus, kTissueRatio, units.length,
      units.force, inp_mesh_text(mesh_from_model(model)), mu, lambda, is_linear ? ", MEAN DILATATION" : "",
      kFixedSet);
}

// Rounds down to two digits, for numbers that people read.
double two_digits(double value) {
  return std::stod(fmt::format("{:.2g}", value));
}

std::string scene_text(const Model& model, const NewArguments& arguments, const Units& units,
                       const std::string& model_name) {
  const double edge = extract_surface(model).mean_edge;
  const bool has_probe = !arguments.probe.empty();
  return fmt::format(
      "# {0}, {1}: {2} nodes, {3} elements. Each key: docs/scene_file.md.\n"
      "model = \"{4}\"            # path relative to this file\n\n"
      "[units]                        # what the numbers of the model and of this file mean\n"
      "length = \"{5}\"\nforce = \"{6}\"\n\n"
      "[contact]\n"
      "sites = {7}              # {8}\n"
      "max_displacement = {9:g}       # how far a tool may push or pull a site: half of a mean surface edge "
      "h\n"
      "directions = \"all\"             # push, pull and drag; \"inward\" would leave out pulling\n"
      "tip_radius = {10:g}             # along the surface: one edge and a little, so a tip moves its "
      "neighbours\n"
      "max_contacts = 2               # tools that may touch at the same time\n\n"
      "[output]\n"
      "nodes = \"surface\"              # nodes whose displacement the scene shows\n\n"
      "[accuracy]\n"
      "target = 0.01                  # 95 of 100 answers are wrong by at most 1 % of the tool's "
      "displacement\n\n"
      "[budget]\n"
      "frame_us = 200                 # microseconds of one core that a haptic frame may take\n\n"
      "[models]\n"
      "zone = true                    # nonlinear elements about the contacts; nothing is sampled\n"
      "linear = false                 # the linear model answers only until a zone is prepared\n"
      "polynomial = false             # true: the fastest frames of single contacts, and a long build\n",
      arguments.mesh.filename().string(), arguments.tissue, model.num_nodes(), model.elements.size(),
      model_name, units.length, units.force, has_probe ? "\"PROBE\"" : "\"surface\"",
      has_probe ? "a node set of the model" : "every free node of the surface", two_digits(0.5 * edge),
      two_digits(1.2 * edge));
}

void run_new(const NewArguments& arguments) {
  const Units& units = units_of(arguments.unit);
  const auto [model, is_guess] = marked_organ(arguments);
  const std::string stem = arguments.mesh.stem().string();
  const std::filesystem::path scene = arguments.folder / (stem + ".toml");
  std::filesystem::path organ = arguments.folder / (stem + ".inp");
  std::error_code error;
  if (std::filesystem::equivalent(organ, arguments.mesh, error))
    organ = arguments.folder / (stem + "_organ.inp");
  for (const std::filesystem::path& file : {scene, organ}) {
    if (std::filesystem::exists(file, error))
      throw std::runtime_error(file.string() + ": exists already; remove it, or name another folder with -o");
  }
  std::filesystem::create_directories(arguments.folder);
  write_finished_text(organ, model_text(model, arguments, units));
  write_finished_text(scene, scene_text(model, arguments, units, organ.filename().string()));
  fmt::print("tissue     {}, shear modulus {:g} kPa, Poisson's ratio {:g}: docs/tissues.md says from where\n",
             arguments.tissue, tissue_of(arguments.tissue).shear_modulus, kTissueRatio);
  fmt::print("fixed      {} nodes{}\n", model.node_sets.at(kFixedSet).size(),
             is_guess ? ": a guess, the lowest tenth along z; say with --fix what holds the organ" : "");
  fmt::print("wrote      {} and {}\n\nNext:\n", organ.string(), scene.string());
  const std::string pack = (arguments.folder / (stem + ".pack")).string();
  fmt::print("  palpate build {} -o {}\n  palpate validate {}\n", scene.string(), pack, pack);
}

template <typename Rows>
std::vector<std::string> names_of(const Rows& rows, const char* (*name)(const typename Rows::value_type&)) {
  std::vector<std::string> names;
  names.reserve(rows.size());
  for (const auto& row : rows) names.emplace_back(name(row));
  return names;
}

}  // namespace

void add_new_command(CLI::App& app) {
  auto arguments = std::make_shared<NewArguments>();
  CLI::App* command = app.add_subcommand("new", "Write a scene for a mesh of an organ, ready to build");
  command->footer(
      "Writes NAME.inp, with a tissue and supports, and NAME.toml, the scene, with comments. Places for "
      "--fix "
      "and --probe:\n"
      "  \"z<10%\"               the lowest tenth; also x, y, > and a length: \"x>3.5\"\n"
      "  \"box x,y,z,x,y,z\"     between two corners\n"
      "  \"nearest x,y,z,r\"     the nearest node, and all within r\n"
      "  NAME                  a node set of the mesh\n\n"
      "Example: palpate new liver.vtk --tissue liver --unit mm\n"
      "         palpate build liver.toml -o liver.pack");
  command->add_option("FILE", arguments->mesh, "Mesh of the organ, in any format that `convert` reads")
      ->type_name("")
      ->required();
  command->add_option("-o,--output", arguments->folder, "Folder to write to; default: this one")
      ->type_name("DIR");
  command->add_option("--tissue", arguments->tissue, "Tissue of the organ")
      ->check(CLI::IsMember(names_of(kTissues, [](const Tissue& tissue) { return tissue.name; })))
      ->capture_default_str();
  command->add_option("--unit", arguments->unit, "Length unit of the mesh, after --scale")
      ->check(CLI::IsMember(names_of(kUnits, [](const Units& units) { return units.length; })))
      ->capture_default_str();
  command
      ->add_option("--fix", arguments->fix,
                   "Where the organ is held; default: set FIXED, or the lowest tenth")
      ->type_name("PLACE");
  command
      ->add_option("--probe", arguments->probe, "Where tools touch; default: everywhere on the free surface")
      ->type_name("PLACE");
  command->add_option("--scale", arguments->scale, "Multiply all positions; 1000: from metres to millimetres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->callback([arguments] { run_new(*arguments); });
}

}  // namespace palpate
