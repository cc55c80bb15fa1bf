// palpate check: prints size, parts, supports, element shapes and cost of an organ's file, and the faults that
// stop a build.
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>

#include "offline/cli/check_report.hpp"
#include "offline/cli/commands.hpp"
#include "offline/cli/organ_file.hpp"
#include "offline/cli/organ_options.hpp"
#include "offline/io/node_selection.hpp"
#include "offline/mesh/rigid_motion.hpp"
#include "offline/mesh/surface.hpp"

namespace palpate {
namespace {

struct CheckArguments {
  std::filesystem::path file;
  OrganOptions options;
  std::string unit;
  std::string fix;
  std::string probe;
  bool json = false;
};

SelectedNodes selected(const Model& model, const std::vector<int>& nodes) {
  SelectedNodes result;
  result.num_nodes = static_cast<int>(nodes.size());
  for (const int node : nodes) result.box.extend(model.positions[static_cast<size_t>(node)]);
  result.num_touchable = static_cast<int>(touchable_nodes(model, nodes).size());
  return result;
}

// Finds the supports: of --fix, of the file, or those that `palpate new` would take from the file.
std::vector<PrescribedDisplacement> find_supports(const CheckArguments& arguments, const Model& model,
                                                  std::string& held_by) {
  const auto set = model.node_sets.find(kFixedSet);
  if (!arguments.fix.empty()) {
    held_by = "--fix " + arguments.fix;
    return held_dofs(select_nodes(model, arguments.fix, "--fix"));
  }
  if (!model.fixed.empty()) {
    held_by = "*BOUNDARY";
    return model.fixed;
  }
  if (set == model.node_sets.end() || set->second.empty()) return {};
  held_by = fmt::format("the node set {}, which `palpate new` holds", kFixedSet);
  return held_dofs(set->second);
}

// Estimates the cost with the tissue and the supports that `palpate new` gives where the file has none.
void add_cost(const CheckArguments& arguments, OrganFile organ, CheckReport& report) {
  if (!report.check.faults.empty()) {
    report.cost_of = "a build refuses this mesh";
    return;
  }
  const std::vector<PrescribedDisplacement> supports = organ.model.fixed;
  if (organ.has_laws) {
    report.cost_of = "this deck";
  } else {
    set_tissue(organ, kTissues.front(), kUnits.front());
    report.cost_of =
        fmt::format("this mesh as {}", organ.moduli.has_young ? "its array E says" : kTissues.front().name);
  }
  organ.model.fixed = supports;
  if (supports.empty()) {
    const HeldPlace held = find_held_place(organ.model, "");
    organ.model.fixed = held_dofs(held.nodes);
    report.cost_of += fmt::format(", held at its lowest {} %", held.guessed_percent);
  }
  if (!loose_parts(organ.model, organ.model.fixed).empty()) {
    report.cost_of = "hold every part first";
    return;
  }
  try {
    std::vector<int> sites;
    if (!arguments.probe.empty()) sites = probed_nodes(organ.model, arguments.probe);
    const Scene scene = default_scene(organ.model, std::move(sites));
    if (scene.sites.empty()) throw std::runtime_error(kNothingFree);
    report.cost = estimate_cost(scene, organ.model);
  } catch (const std::runtime_error& error) {
    report.cost_of = error.what();
  }
}

// Adds the warning and the faults that `palpate new` finds with the supports, or with those that it guesses.
void find_more_faults(const OrganFile& organ, CheckReport& report) {
  OrganCheck& check = report.check;
  const Units& units = report.unit == nullptr ? kUnits.front() : *report.unit;
  if (std::string warning = moduli_warning(organ, units); !warning.empty())
    check.warnings.push_back(std::move(warning));
  if (!check.faults.empty()) return;
  if (organ.has_laws || !report.held_by.empty()) {
    add_loose_parts(organ, check, check.faults);
  } else if (const auto held = held_dofs(find_held_place(organ.model, "").nodes);
             loose_parts(organ.model, held).empty()) {
    if (std::string message = hinged_message(organ.model, held); !message.empty())
      check.faults.push_back(std::move(message));
  }
}

void run_check(const CheckArguments& arguments) {
  OrganFile organ = read_organ(arguments.file, arguments.options);
  Model& model = organ.model;
  if (organ.is_deck() && !arguments.fix.empty()) refuse_deck_option(arguments.file.string(), "--fix");
  for (const std::string& warning : model.warnings) fmt::print(stderr, "{}\n", warning);
  CheckReport report;
  report.model = &model;
  if (!arguments.unit.empty()) report.unit = &units_of(arguments.unit);
  model.fixed = find_supports(arguments, model, report.held_by);
  if (!arguments.fix.empty()) report.fix = selected(model, select_nodes(model, arguments.fix, "--fix"));
  if (!arguments.probe.empty())
    report.probe = selected(model, select_nodes(model, arguments.probe, "--probe"));
  report.check = check_organ(model, model.fixed);
  std::vector<std::string>& faults = report.check.faults;
  for (const std::string& fault : organ.faults) {
    if (std::find(faults.begin(), faults.end(), fault) == faults.end()) faults.push_back(fault);
  }
  find_more_faults(organ, report);
  if (!arguments.json) print_check_text(report);  // before the solves, which large organs wait for
  add_cost(arguments, organ, report);
  if (arguments.json) {
    print_check_json(report);
  } else {
    print_cost_text(report);
  }
  if (!faults.empty())
    throw std::runtime_error(fmt::format(
        "{}: a build refuses it: {}", model.file,
        faults.size() == 1 ? "see the line \"refused\", with the remedy"
                           : fmt::format("see {} lines \"refused\", with remedies", faults.size())));
}

}  // namespace

void add_check_command(CLI::App& app) {
  auto arguments = std::make_shared<CheckArguments>();
  CLI::App* command =
      app.add_subcommand("check", "Say what a mesh or a deck is: size, parts, supports, shape, cost");
  command->footer(
      "Reads any mesh that `palpate convert` reads, and changes no file. \"refused\" lines say what a build "
      "refuses, and how to mend it. The histogram counts the angles between faces of the elements.\n\n" +
      std::string(kPlacesHelp) + "\nExample: palpate check liver.vtk --unit mm --fix \"z<10%\"");
  command->add_option("FILE", arguments->file, "Mesh file, or .inp file with laws and supports")
      ->type_name("")
      ->required();
  add_organ_options(*command, arguments->options);
  command->add_option("--unit", arguments->unit, "Length unit of the mesh, after --scale; default: not known")
      ->check(CLI::IsMember(unit_names()));
  command->add_option("--fix", arguments->fix, "Where the organ is held; default: as the file says")
      ->type_name("PLACE");
  command->add_option("--probe", arguments->probe, "Where tools touch; default: everywhere")
      ->type_name("PLACE");
  command->add_flag("--json", arguments->json, "Print as JSON");
  command->callback([arguments] { run_check(*arguments); });
}

}  // namespace palpate
