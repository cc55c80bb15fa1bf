// palpate check: the size, parts and element shapes of a mesh.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "offline/cli/commands.hpp"
#include "offline/cli/json_text.hpp"
#include "offline/cli/organ_file.hpp"
#include "offline/io/organ_check.hpp"

namespace palpate {
namespace {

struct CheckArguments {
  std::filesystem::path file;
  double scale = 1;
  bool json = false;
};

// The organ's longest side in centimetres under each guess of the unit.
std::string lengths(double longest) {
  return fmt::format("{:.3g} cm long if mm, {:.3g} cm if cm, {:.3g} cm if m", longest / 10, longest,
                     longest * 100);
}

void print_text(const std::filesystem::path& file, const OrganCheck& check) {
  const Eigen::Vector3d size = check.box.sizes();
  fmt::print("mesh       {}: {} nodes, {} elements{}\n", file.string(), check.num_nodes, check.num_elements,
             check.num_quadratic > 0 ? fmt::format(", {} of ten nodes", check.num_quadratic) : "");
  fmt::print("size       {:.4g} x {:.4g} x {:.4g}: {}\n", size[0], size[1], size[2],
             lengths(size.maxCoeff()));
  fmt::print("surface    {} nodes, mean edge h = {:.4g}, volume {:.4g}\n", check.num_surface_nodes,
             check.mean_edge, check.volume);
  fmt::print(
      "parts      {}{}\n", check.num_components,
      check.num_components > 1 ? ": each needs supports of its own, unless they are meant to be joined" : "");
  if (check.num_open_edges > 0)
    fmt::print(
        "joints     {} edges of the surface have other than two faces: parts touch there along an edge\n",
        check.num_open_edges);
  fmt::print("angles     between faces: {:.3g} to {:.3g} degrees\n", check.least_angle, check.largest_angle);
  const int most = std::max(1, *std::max_element(check.angles.begin(), check.angles.end()));
  constexpr int kBarLength = 40;
  for (size_t bin = 0; bin < check.angles.size(); ++bin) {
    if (check.angles[bin] == 0) continue;
    fmt::print("           {:3} .. {:3}  {:7} {}\n", 10 * bin, 10 * bin + 10, check.angles[bin],
               std::string(static_cast<size_t>(kBarLength * check.angles[bin] / most), '#'));
  }
  if (check.num_slivers > 0)
    fmt::print("slivers    {} elements with an angle below {:g} degrees, worst first: {}\n",
               check.num_slivers, kSliverAngle, fmt::join(check.slivers, " "));
}

void print_json(const std::filesystem::path& file, const OrganCheck& check) {
  const Eigen::Vector3d size = check.box.sizes();
  const nlohmann::json json = {{"file", file.string()},
                               {"nodes", check.num_nodes},
                               {"elements", check.num_elements},
                               {"ten_node_elements", check.num_quadratic},
                               {"size", {size[0], size[1], size[2]}},
                               {"surface_nodes", check.num_surface_nodes},
                               {"mean_surface_edge", check.mean_edge},
                               {"volume", check.volume},
                               {"parts", check.num_components},
                               {"open_edges", check.num_open_edges},
                               {"least_angle", check.least_angle},
                               {"largest_angle", check.largest_angle},
                               {"angles", check.angles},
                               {"slivers", check.num_slivers},
                               {"worst_elements", check.slivers}};
  fmt::print("{}\n", json_text(json));
}

}  // namespace

void add_check_command(CLI::App& app) {
  auto arguments = std::make_shared<CheckArguments>();
  CLI::App* command = app.add_subcommand("check", "Say what a mesh is: size, parts, shape of its elements");
  command->footer(
      "Reads any mesh that `palpate convert` reads. The histogram counts the angles between faces of the "
      "elements.\n\n"
      "Example: palpate check liver.vtk");
  command->add_option("FILE", arguments->file, "Mesh file")->type_name("")->required();
  command->add_option("--scale", arguments->scale, "Multiply all positions; 1000: from metres to millimetres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print as JSON");
  command->callback([arguments] {
    const OrganCheck check = check_organ(read_organ(arguments->file, arguments->scale));
    if (arguments->json) {
      print_json(arguments->file, check);
    } else {
      print_text(arguments->file, check);
    }
  });
}

}  // namespace palpate
