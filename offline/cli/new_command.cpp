// palpate new: a scene, and a model with a tissue and supports, for any mesh of an organ.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "offline/cli/commands.hpp"
#include "offline/cli/organ_options.hpp"
#include "offline/cli/organ_scene.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/inp_format.hpp"
#include "offline/io/model_from_mesh.hpp"
#include "offline/io/organ_check.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

struct NewArguments {
  std::filesystem::path mesh;
  std::filesystem::path folder = ".";
  OrganOptions options;
  std::string tissue;
  std::string unit = "mm";
  std::string fix;
  std::string probe;
};

// Returns the text of the laws, a section for each.
std::string laws_text(const Model& model) {
  const bool is_linear = model.elements.front().num_nodes == 4;
  std::string text;
  for (const Material& material : model.materials) {
    const auto& law = std::get<CompressibleNeoHookean>(material.law);
    text += fmt::format(
        "*MATERIAL, NAME={0}\n*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n{1:.6g}, {2:.6g}\n"
        "*SOLID SECTION, ELSET={3}, MATERIAL={0}{4}\n",
        material.name, law.mu, law.lambda, model.materials.size() > 1 ? material.name : "ALL",
        is_linear ? ", MEAN DILATATION" : "");
  }
  return text;
}

std::string tissue_text(const OrganFile& organ, const Tissue& tissue) {
  if (organ.has_laws) return "as the model says";
  if (organ.moduli.has_young)
    return fmt::format("{} materials from the array E of the mesh", organ.moduli.groups.size());
  return fmt::format(
      "{}, shear modulus {:g} kPa, Poisson's ratio {}", tissue.name, tissue.shear_modulus,
      organ.moduli.has_nu ? "from the array nu of the mesh" : fmt::format("{:g}", kTissueRatio));
}

std::string model_text(const OrganFile& organ, const NewArguments& arguments, const Units& units) {
  return fmt::format("*HEADING\n{}: {}. Units: {}, {}.\n{}{}*BOUNDARY\n{}, 1, 3\n",
                     arguments.mesh.filename().string(), tissue_text(organ, tissue_of(arguments.tissue)),
                     units.length, units.force, inp_mesh_text(mesh_from_model(organ.model)),
                     laws_text(organ.model), kFixedSet);
}

// The sites of a scene: a set that this command writes, labels for a model that it does not write, or all.
std::string sites_text(const OrganFile& organ, const std::vector<int>& probe) {
  if (probe.empty()) return "\"surface\"";
  if (!organ.is_deck()) return fmt::format("\"{}\"", kProbeSet);
  std::string list;
  for (const int node : probe)
    list += fmt::format("{}{}", list.empty() ? "[" : ", ", organ.model.labels[static_cast<size_t>(node)]);
  return list + "]";
}

// Quotes a basic string of TOML.
std::string toml_text(const std::string& text) {
  std::string quoted = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\') quoted += '\\';
    quoted += letter;
  }
  return quoted + '"';
}

// Quotes a word of a shell command where it needs that.
std::string shell_word(const std::string& text) {
  const auto is_plain = [](char letter) {
    return std::isalnum(static_cast<unsigned char>(letter)) != 0 ||
           std::string_view("_-+.,/:=@%").find(letter) != std::string_view::npos;
  };
  if (!text.empty() && std::ranges::all_of(text, is_plain)) return text;
  std::string quoted = "'";
  for (const char letter : text) quoted += letter == '\'' ? "'\\''" : std::string(1, letter);
  return quoted + "'";
}

std::string scene_text(const OrganFile& organ, const NewArguments& arguments, const std::vector<int>& probe,
                       const std::string& model_name) {
  const Model& model = organ.model;
  const Units& units = units_of(arguments.unit);
  const Scene scene = default_scene(model, probe);
  return fmt::format(
      "# {0}: {1} nodes, {2} elements; {3}. Each key: docs/scene_file.md.\n"
      "model = {4}            # path relative to this file\n{5}\n"
      "[units]                        # what the numbers of the model and of this file mean\n"
      "length = \"{6}\"\nforce = \"{7}\"\n\n"
      "[contact]\n"
      "sites = {8}              # {9}\n"
      "max_displacement = {10:g}       # how far a tool may push or pull a site: half of a mean surface edge "
      "h\n"
      "directions = \"all\"             # push, pull and drag; \"inward\" would leave out pulling\n"
      "tip_radius = {11:g}             # along the surface: one edge and a little, so a tip moves its "
      "neighbours\n"
      "max_contacts = {12}               # tools that may touch at the same time\n\n"
      "[output]\n"
      "nodes = \"surface\"              # nodes whose displacement the scene shows\n\n"
      "[accuracy]\n"
      "target = 0.01                  # 95 of 100 answers are wrong by at most 1 % of the tool's "
      "displacement\n\n"
      "[budget]\n"
      "frame_us = {13:g}                 # microseconds of one core that a haptic frame may take\n\n"
      "[models]\n",
      arguments.mesh.filename().string(), model.num_nodes(), model.elements.size(),
      tissue_text(organ, tissue_of(arguments.tissue)), toml_text(model_name),
      organ.is_deck() && model.merge_length > 0 ? fmt::format("merge = {:g}\n", model.merge_length) : "",
      units.length, units.force, sites_text(organ, probe),
      probe.empty() ? "every free node of the surface" : "the free surface nodes of --probe",
      scene.max_displacement, scene.tip_radius, scene.max_contacts, scene.frame_budget_us);
}

std::string models_text(const Model& model) {
  if (model.small_strain())
    return "linear = true                  # the law is linear, so this model is exact\n"
           "polynomial = false             # fits of nonlinear answers\n";
  return "zone = true                    # nonlinear elements about the contacts; nothing is sampled\n"
         "linear = false                 # it answers only until a zone is prepared; many sites make it most "
         "of "
         "the\n"
         "                               # pack, and sites = \"SET\" makes it smaller\n"
         "polynomial = false             # true: the fastest frames of single contacts, and a long build\n";
}

// Refuses options that a model with its own laws and supports has no place for.
void check_deck_options(const NewArguments& arguments, bool has_tissue) {
  const auto refuse = [&](const char* option) { refuse_deck_option(arguments.mesh.string(), option); };
  if (has_tissue) refuse("--tissue");
  if (!arguments.fix.empty()) refuse("--fix");
  if (arguments.options.scale != 1) refuse("--scale");
  if (arguments.options.keep_largest) refuse("--keep");
}

void print_tissue(const OrganFile& organ, const NewArguments& arguments) {
  const Units& units = units_of(arguments.unit);
  fmt::print("tissue     {}{}\n", tissue_text(organ, tissue_of(arguments.tissue)),
             organ.has_laws || organ.moduli.has_young ? "" : ": docs/tissues.md says from where");
  const ElementModuli& moduli = organ.moduli;
  if (moduli.has_young) {
    const auto [least, largest] =
        std::minmax_element(moduli.groups.begin(), moduli.groups.end(),
                            [](const auto& a, const auto& b) { return a.young < b.young; });
    fmt::print("           E from {:.4g} to {:.4g}, taken as {}, the pressure unit of {}{}\n", least->young,
               largest->young, units.pressure, units.length,
               moduli.has_nu ? "" : fmt::format("; Poisson's ratio {:g}", kTissueRatio));
  }
  if (moduli.largest_change > 0 || moduli.largest_nu_change > 0)
    fmt::print("           near values are taken together: E changes by up to {:.2g} %, nu by up to {:.2g}\n",
               100 * moduli.largest_change, moduli.largest_nu_change);
  if (!organ.has_laws && moduli.empty()) {
    std::string sets;
    for (const auto& [name, elements] : organ.model.element_sets) {
      if (name != "ALL") sets += fmt::format("{}{} ({})", sets.empty() ? "" : ", ", name, elements.size());
    }
    if (!sets.empty())
      fmt::print("           one law for all element sets: {}; edit the file to give a set another one\n",
                 printable(sets, 300));
  }
}

// Gives a mesh the tissue and the supports. Returns where it is held.
HeldPlace dress(OrganFile& organ, const NewArguments& arguments) {
  if (organ.has_laws) throw InputError({organ.model.file, 0}, kNothingHeld);
  set_tissue(organ, tissue_of(arguments.tissue), units_of(arguments.unit));
  if (const std::string warning = moduli_warning(organ, units_of(arguments.unit)); !warning.empty())
    fmt::print(stderr, "{}\n", warning);
  HeldPlace held = find_held_place(organ.model, arguments.fix);
  organ.model.node_sets[kFixedSet] = held.nodes;
  organ.model.fixed = held_dofs(held.nodes);
  return held;
}

// Names the files to write, which must not exist.
std::filesystem::path new_file(const NewArguments& arguments, const std::string& name) {
  std::filesystem::path file = arguments.folder / name;
  std::error_code error;
  if (std::filesystem::exists(file, error))
    throw std::runtime_error(file.string() + ": exists already; remove it, or name another folder with -o");
  return file;
}

void run_new(NewArguments arguments) {
  OrganFile organ = read_organ(arguments.mesh, arguments.options);
  for (const std::string& warning : organ.model.warnings) fmt::print(stderr, "{}\n", warning);
  if (!organ.faults.empty()) throw InputError(organ.faults.front());
  const bool is_deck = organ.is_deck();
  if (is_deck) check_deck_options(arguments, !arguments.tissue.empty());
  if (arguments.tissue.empty()) arguments.tissue = kTissues.front().name;
  const std::string stem = arguments.mesh.stem().string();
  const std::filesystem::path scene = new_file(arguments, stem + ".toml");
  std::filesystem::path model_file = arguments.mesh;
  HeldPlace held;
  if (!is_deck) {
    held = dress(organ, arguments);
    std::error_code error;
    const bool is_own =
        std::filesystem::equivalent(arguments.folder / (stem + ".inp"), arguments.mesh, error);
    model_file = new_file(arguments, stem + (is_own ? "_organ.inp" : ".inp"));
  }
  const OrganCheck check = check_organ(organ.model, organ.model.fixed);
  if (std::vector<std::string> faults = check.faults; add_loose_parts(organ, check, faults), !faults.empty())
    throw InputError(fmt::format("{}", fmt::join(faults, "\n")));
  for (const std::string& warning : check.warnings) fmt::print(stderr, "{}\n", warning);
  std::vector<int> probe;
  if (!arguments.probe.empty()) probe = probed_nodes(organ.model, arguments.probe);
  if (default_scene(organ.model, probe).sites.empty()) throw InputError({organ.model.file, 0}, kNothingFree);
  if (!is_deck && !probe.empty()) organ.model.node_sets[kProbeSet] = probe;
  std::filesystem::create_directories(arguments.folder);
  if (!is_deck) write_finished_text(model_file, model_text(organ, arguments, units_of(arguments.unit)));
  const std::string name = std::filesystem::proximate(model_file, arguments.folder).generic_string();
  write_finished_text(scene, scene_text(organ, arguments, probe, name) + models_text(organ.model));
  print_tissue(organ, arguments);
  fmt::print("fixed      {} nodes{}\n", check.num_held_nodes,
             held.guessed_percent > 0
                 ? fmt::format(": a guess, the lowest {} % along z; say with --fix what holds the organ",
                               held.guessed_percent)
                 : "");
  fmt::print("wrote      {}{}\n\nNext:\n", is_deck ? "" : model_file.string() + " and ", scene.string());
  const std::string pack = shell_word((arguments.folder / (stem + ".pack")).string());
  fmt::print("  palpate build {} -o {}\n  palpate validate {}\n", shell_word(scene.string()), pack, pack);
}

std::vector<std::string> tissue_names() {
  std::vector<std::string> names;
  names.reserve(kTissues.size());
  for (const Tissue& tissue : kTissues) names.emplace_back(tissue.name);
  return names;
}

}  // namespace

void add_new_command(CLI::App& app) {
  auto arguments = std::make_shared<NewArguments>();
  CLI::App* command = app.add_subcommand("new", "Write a scene for a mesh of an organ, ready to build");
  command->footer(
      "Writes NAME.inp, with a tissue and supports, and NAME.toml, the scene, with comments. An .inp file "
      "that "
      "has laws and supports stays as it is and gets a scene alone. Arrays \"E\" and \"nu\" of cells or "
      "points "
      "become materials; E is in kPa for mm, in N/cm^2 for cm, in Pa for m.\n\n" +
      std::string(kPlacesHelp) +
      "\nExample: palpate new liver.vtk --tissue liver --unit mm\n"
      "         palpate build liver.toml -o liver.pack");
  command->add_option("FILE", arguments->mesh, "Mesh of the organ, in any format that `convert` reads")
      ->type_name("")
      ->required();
  command->add_option("-o,--output", arguments->folder, "Folder to write to; default: this one")
      ->type_name("DIR");
  command->add_option("--tissue", arguments->tissue, "Tissue of the organ")
      ->check(CLI::IsMember(tissue_names()))
      ->default_str(kTissues.front().name);
  command->add_option("--unit", arguments->unit, "Length unit of the mesh, after --scale")
      ->check(CLI::IsMember(unit_names()))
      ->capture_default_str();
  command
      ->add_option("--fix", arguments->fix,
                   "Where the organ is held; default: set FIXED, or the lowest tenth")
      ->type_name("PLACE");
  command
      ->add_option("--probe", arguments->probe, "Where tools touch; default: everywhere on the free surface")
      ->type_name("PLACE");
  add_organ_options(*command, arguments->options);
  command->callback([arguments] { run_new(*arguments); });
}

}  // namespace palpate
