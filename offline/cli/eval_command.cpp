// palpate eval: one response of the real runtime, compared with a full solve of the same push on request.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <unordered_map>

#include "offline/cli/commands.hpp"
#include "offline/cli/contact_arguments.hpp"
#include "offline/cli/json_text.hpp"
#include "offline/cli/nodal_table.hpp"
#include "offline/cli/patch_pressure.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/pipeline/organ_size.hpp"
#include "offline/precompute/error_survey.hpp"

namespace palpate {
namespace {

struct EvalArguments {
  std::filesystem::path pack;
  ContactArguments contacts;
  std::filesystem::path output;
  std::filesystem::path reference;
  bool json = false;
};

// The full solution of the same push.
struct Reference {
  std::vector<Eigen::Vector3d> forces;  // one for each contact: sum over its patch
  double largest_displacement = 0;
  double displacement_error = 0;  // of the runtime: max over packed nodes |u - u_FE| / largest |d|
};

// Calls `use` for each packed node of a site's patch.
template <typename Use>
void for_each_patch_node(const OpenedPack& opened, std::uint32_t site, const Use& use) {
  const pack::ContactSites& sites = *opened.tables().sites();
  const auto starts = opened.segment(*sites.patch_starts());
  for (std::uint32_t i = starts[site]; i < starts[site + 1]; ++i)
    use(opened.segment(*sites.contact_nodes())[opened.segment(*sites.patch_nodes())[i]]);
}

// Reads the full solve of the same contacts from `file` and compares the runtime's field.
Reference compare(const OpenedPack& opened, const ContactAnswer& answer, const std::filesystem::path& file) {
  std::unordered_map<int, NodalRow> rows;
  for (const NodalRow& row : read_nodal_table(file)) rows.emplace(row.label, row);
  const auto row_of = [&](int label) -> const NodalRow& {
    const auto found = rows.find(label);
    if (found == rows.end())
      throw std::runtime_error(fmt::format(
          "{}: node {} of the pack is missing; give the result of the same model", file.string(), label));
    return found->second;
  };
  for (const TouchedPlace& place : answer.places) {
    if (place.corners.size() > 1) {
      throw std::runtime_error(
          fmt::format("--reference: between sites, as at {}, the response blends {} sites and has no single "
                      "solve; use --contact",
                      place.name, place.corners.size()));
    }
  }
  const pal_geometry geometry = opened.pack().geometry();
  // number of contacts whose patches contain a packed node
  std::unordered_map<std::uint32_t, int> contacts_at_node;
  for (const auto& contact : answer.contacts)
    for_each_patch_node(opened, contact.site, [&](std::uint32_t packed) { ++contacts_at_node[packed]; });
  Reference reference;
  double largest_push = 0;
  for (size_t c = 0; c < answer.contacts.size(); ++c) {
    const Eigen::Vector3d d(answer.contacts[c].displacement);
    // Table rows are relative to the mesh, d is relative to rest under gravity.
    const auto displacement_from_mesh = [&](std::uint32_t node) -> Eigen::Vector3d {
      const Eigen::Map<const Eigen::Vector3d> rest(geometry.rest_positions + size_t{3} * node);
      return d + rest - Eigen::Map<const Eigen::Vector3d>(geometry.positions + size_t{3} * node);
    };
    largest_push = std::max(largest_push, d.norm());
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for_each_patch_node(opened, answer.contacts[c].site, [&](std::uint32_t packed) {
      const NodalRow& row = row_of(geometry.labels[packed]);
      const Eigen::Vector3d expected = displacement_from_mesh(packed);
      if ((row.displacement - expected).norm() > 1e-6 * expected.norm()) {
        throw std::runtime_error(
            fmt::format("{}: node {} of the patch of contact {} has another displacement; give the solve of "
                        "the same push",
                        file.string(), row.label, answer.places[c].name));
      }
      if (!row.force) {
        throw std::runtime_error(
            fmt::format("{}: node {} has no force; give a stepN.csv of `solve`", file.string(), row.label));
      }
      force += *row.force / contacts_at_node[packed];  // contacts share the force of a common node
    });
    reference.forces.push_back(force);
  }
  for (std::uint32_t i = 0; i < geometry.num_nodes; ++i) {
    const NodalRow& row = row_of(geometry.labels[i]);
    reference.largest_displacement = std::max(reference.largest_displacement, row.displacement.norm());
    reference.displacement_error =
        std::max(reference.displacement_error, (answer.field.segment<3>(3 * i) - row.displacement).norm());
  }
  if (largest_push > 0) reference.displacement_error /= largest_push;
  return reference;
}

// Returns the mean of the corner patches' pressures, with the weights of the corners.
std::optional<double> mean_pressure(const OpenedPack& opened, const TouchedPlace& place,
                                    const double force[3]) {
  double sum = 0;
  for (const auto& [label, weight] : place.corners) {
    std::uint32_t site = 0;
    require_ok(opened.pack().find_site(label, site), "site");
    const std::optional<double> pressure = patch_pressure(opened, site, force);
    if (!pressure) return std::nullopt;
    sum += weight * *pressure;
  }
  return sum;
}

void add_point(const TouchedPlace& place, nlohmann::json& contact) {
  contact["at"] = {place.position[0], place.position[1], place.position[2]};
  contact["distance"] = place.distance;
  contact["corners"] = nlohmann::json::array();
  for (const auto& [label, weight] : place.corners)
    contact["corners"].push_back({{"node", label}, {"weight", weight}});
}

// In mean surface edges. A point farther from the surface gets a flag, as the user may mean another place.
constexpr double kFarFromSurface = 0.1;

bool is_far_from_surface(const OpenedPack& opened, const TouchedPlace& place) {
  return place.distance >
         kFarFromSurface * opened.info().mean_surface_edge / opened.info().metres_per_length_unit;
}

// Returns the runtime's flags, and the flags of this command: off_surface and holds_fixed_node.
std::vector<std::string> flags_of(const OpenedPack& opened, const ContactAnswer& answer, size_t c) {
  std::vector<std::string> flags = flag_names(answer.results[c].flags);
  if (is_far_from_surface(opened, answer.places[c])) flags.emplace_back("off_surface");
  if (answer.places[c].holds_fixed_node) flags.emplace_back("holds_fixed_node");
  return flags;
}

bool has_small_tip(const OpenedPack& opened) {
  return is_tip_below_edge(opened.tables().sites()->tip_radius(),
                           opened.tables().geometry()->mean_surface_edge());
}

nlohmann::json answer_json(const OpenedPack& opened, const ContactAnswer& answer) {
  nlohmann::json contacts = nlohmann::json::array();
  for (size_t c = 0; c < answer.results.size(); ++c) {
    const pal_contact_result& result = answer.results[c];
    const std::optional<double> pressure = mean_pressure(opened, answer.places[c], result.force);
    contacts.push_back(
        {{"node", answer.places[c].label()},
         {"displacement", answer.contacts[c].displacement},
         {"force", result.force},
         {"pressure", pressure ? nlohmann::json(*pressure) : nlohmann::json()},
         {"stiffness", result.stiffness},
         {"model", model_name(result.model)},
         {"error_estimate", {{"displacement", result.displacement_error}, {"force", result.force_error}}},
         {"flags", flags_of(opened, answer, c)}});
    if (!answer.torques.empty()) {
      const pal_contact_torque& torque = answer.torques[c];
      contacts.back()["torque"] = torque.torque;
      contacts.back()["torque_by_displacement"] = torque.by_displacement;
      contacts.back()["torque_by_rotation"] = torque.by_rotation;
    }
    if (!answer.places[c].is_site) add_point(answer.places[c], contacts.back());
  }
  nlohmann::json json = {{"contacts", contacts}, {"flags", nlohmann::json::array()}};
  if (!answer.results.empty() && has_small_tip(opened)) json["tip_below_edge"] = true;
  return json;
}

std::string corner_names(const TouchedPlace& place) {
  std::vector<int> labels;
  for (const auto& corner : place.corners) labels.push_back(corner.first);
  return fmt::format("{}", fmt::join(labels, ", "));
}

void print_answer(const OpenedPack& opened, const ContactAnswer& answer) {
  const std::string length = opened.length_suffix();
  const std::string force_unit = opened.force_suffix();
  if (answer.results.empty()) fmt::print("no contact: the tissue is at rest\n");
  for (size_t c = 0; c < answer.results.size(); ++c) {
    const pal_contact_result& result = answer.results[c];
    const Eigen::Vector3d force(result.force);
    fmt::print("contact {}{}: model {}, force ({:.6g}, {:.6g}, {:.6g}){}, size {:.6g}; ",
               answer.places[c].is_site ? "" : "at ", answer.places[c].name, model_name(result.model),
               force[0], force[1], force[2], force_unit, force.norm());
    if (result.displacement_error < 1) {
      fmt::print("estimated error: displacement {:.3g} %, force {:.3g} %", 100 * result.displacement_error,
                 100 * result.force_error);
    } else {
      fmt::print("the survey does not cover this contact: its error is unknown");
    }
    if (const auto pressure = mean_pressure(opened, answer.places[c], result.force)) {
      const std::string unit = length.empty() ? "" : fmt::format("{}/{}^2", force_unit, opened.length_unit());
      fmt::print("; mean pressure {:.4g}{}", *pressure, unit);
    }
    if (!answer.torques.empty()) {
      const double* torque = answer.torques[c].torque;
      fmt::print("; torque ({:.6g}, {:.6g}, {:.6g}){}{}", torque[0], torque[1], torque[2], force_unit,
                 length);
    }
    if (answer.contacts[c].force_axes != 0) {
      const double* d = answer.contacts[c].displacement;
      fmt::print("; moved by ({:.6g}, {:.6g}, {:.6g}){}", d[0], d[1], d[2], length);
    }
    if (answer.places[c].corners.size() > 1) fmt::print("; between nodes {}", corner_names(answer.places[c]));
    if (is_far_from_surface(opened, answer.places[c]))
      fmt::print("; {:.3g}{} from the requested place", answer.places[c].distance, length);
    if (const auto flags = flags_of(opened, answer, c); !flags.empty())
      fmt::print("; {}", fmt::join(flags, ", "));
    fmt::print("\n");
  }
  if (!answer.results.empty() && has_small_tip(opened)) {
    fmt::print("{}, and so is its estimated error\n",
               tip_text(opened.tables().sites()->tip_radius(),
                        opened.tables().geometry()->mean_surface_edge(), length));
  }
  fmt::print("largest displacement {:.6g}{}\n", largest_node(answer.field), length);
}

double force_error(const ContactAnswer& answer, const Reference& reference, size_t contact) {
  const Eigen::Vector3d& truth = reference.forces[contact];
  const double difference = (Eigen::Vector3d(answer.results[contact].force) - truth).norm();
  return difference == 0 ? 0 : difference / truth.norm();
}

void add_reference(const ContactAnswer& answer, const Reference& reference, nlohmann::json& json) {
  for (size_t c = 0; c < answer.results.size(); ++c) {
    const Eigen::Vector3d& truth = reference.forces[c];
    json["contacts"][c]["reference"] = {{"force", {truth[0], truth[1], truth[2]}},
                                        {"force_error", force_error(answer, reference, c)}};
  }
  json["reference"] = {{"largest_displacement", reference.largest_displacement},
                       {"displacement_error", reference.displacement_error}};
}

void print_reference(const OpenedPack& opened, const ContactAnswer& answer, const Reference& reference) {
  for (size_t c = 0; c < answer.results.size(); ++c) {
    const Eigen::Vector3d& truth = reference.forces[c];
    fmt::print("full solve {}: force ({:.6g}, {:.6g}, {:.6g}){}, size {:.6g}; force error {:.3g} %\n",
               answer.places[c].name, truth[0], truth[1], truth[2], opened.force_suffix(), truth.norm(),
               100 * force_error(answer, reference, c));
  }
  fmt::print(
      "full solve: largest displacement {:.6g}{}; displacement error {:.3g} % of the push, anywhere shown\n",
      reference.largest_displacement, opened.length_suffix(), 100 * reference.displacement_error);
}

void write_field(const OpenedPack& opened, const ContactAnswer& answer, const std::filesystem::path& file) {
  const pal_geometry geometry = opened.pack().geometry();
  std::vector<NodalRow> rows;
  for (std::uint32_t i = 0; i < geometry.num_nodes; ++i) {
    rows.push_back({geometry.labels[i],
                    Eigen::Map<const Eigen::Vector3d>(geometry.positions + 3 * i),
                    answer.field.segment<3>(3 * i),
                    {}});
  }
  write_nodal_table(file, rows);
}

int run_eval(const EvalArguments& arguments) {
  check_keeps_inputs(arguments.output, {arguments.pack, arguments.reference});
  check_replaces(arguments.output, "node,x,y,z,", "a table of nodes");
  const OpenedPack opened(arguments.pack);
  const ContactAnswer answer = answer_contacts(opened, arguments.contacts);
  // All checks run before the first output.
  std::optional<Reference> reference;
  if (!arguments.reference.empty() && !arguments.contacts.turns.empty())
    throw std::runtime_error("--reference supports pushes without --turn only; remove --turn");
  if (!arguments.reference.empty()) reference = compare(opened, answer, arguments.reference);
  if (!arguments.output.empty()) write_field(opened, answer, arguments.output);
  if (arguments.json) {
    nlohmann::json json = answer_json(opened, answer);
    if (reference) add_reference(answer, *reference, json);
    fmt::print("{}\n", json_text(json));
  } else {
    print_answer(opened, answer);
    if (reference) print_reference(opened, answer, *reference);
  }
  return 0;
}

}  // namespace

void add_eval_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<EvalArguments>();
  CLI::App* command = app.add_subcommand("eval", "Answer one touch through the real runtime, from rest");
  command->footer(
      "Lengths and forces are in the model's units; the force is what the outside must apply to the tissue, "
      "the "
      "pressure its part\ninto the surface over the patch's area. `palpate info PACK` "
      "names the nodes that --contact takes; without a contact the answer is rest.\n\n"
      "Example: palpate eval brain.pack --contact 812=0,0,-8 --json\n"
      "         palpate eval brain.pack --contact 812=0,0,-4 --turn 0,0,20\n"
      "         palpate eval brain.pack --at 10,20,60=0,0,-8");
  command->add_option("PACK", arguments->pack, "Pack made by `palpate build`")->type_name("")->required();
  add_contact_options(*command, arguments->contacts);
  command
      ->add_option("-o,--output", arguments->output,
                   "CSV of the shown nodes' displacements, as `solve` writes")
      ->type_name("OUT.csv");
  command
      ->add_option("--reference", arguments->reference,
                   "stepN.csv of a `solve` of the same push: print its answer beside")
      ->type_name("STEP.csv");
  command->add_flag("--json", arguments->json, "Print the answer as JSON");
  command->callback([arguments, &exit_code] { exit_code = run_eval(*arguments); });
}

}  // namespace palpate
