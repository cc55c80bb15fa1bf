#include "offline/cli/check_report.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "offline/cli/json_text.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

std::string place_text(const Eigen::AlignedBox3d& box) {
  return fmt::format("x {:.4g} .. {:.4g}, y {:.4g} .. {:.4g}, z {:.4g} .. {:.4g}", box.min().x(),
                     box.max().x(), box.min().y(), box.max().y(), box.min().z(), box.max().z());
}

// The organ's longest side in centimetres: in its unit, or under each guess of the unit.
std::string size_text(const CheckReport& report) {
  const Eigen::Vector3d size = report.check.box.sizes();
  const double longest = size.maxCoeff();
  if (report.unit != nullptr) {
    return fmt::format("{:.4g} x {:.4g} x {:.4g} {}: {:.3g} cm long", size[0], size[1], size[2],
                       report.unit->length, longest / report.unit->centimetre);
  }
  std::string guesses;
  for (const Units& unit : kUnits)
    guesses += fmt::format("{}{:.3g} cm{} if {}", guesses.empty() ? "" : ", ", longest / unit.centimetre,
                           guesses.empty() ? " long" : "", unit.length);
  return fmt::format("{:.4g} x {:.4g} x {:.4g}: {}", size[0], size[1], size[2], guesses);
}

std::vector<int> elements_of_materials(const Model& model) {
  std::vector<int> counts(model.materials.size(), 0);
  for (const Tetrahedron& element : model.elements) {
    if (element.material >= 0) ++counts[static_cast<size_t>(element.material)];
  }
  return counts;
}

void print_surface(const CheckReport& report) {
  const OrganCheck& check = report.check;
  const std::string unit = report.unit == nullptr ? "" : fmt::format(" {}", report.unit->length);
  fmt::print("surface    {} nodes, mean edge h = {:.4g}{}, volume {:.4g}{}\n", check.num_surface_nodes,
             check.mean_edge, unit, check.volume, unit.empty() ? "" : unit + "^3");
  if (check.num_shells != static_cast<int>(check.parts.size()) || check.num_cavities > 0)
    fmt::print("shells     {} closed surfaces, {} of them around cavities\n", check.num_shells,
               check.num_cavities);
  if (check.num_open_edges + check.num_shared_nodes > 0)
    fmt::print(
        "joints     not a manifold: {} edges have other than two faces, and at {} nodes faces meet that no "
        "edge joins; parts touch there\n",
        check.num_open_edges, check.num_shared_nodes);
  fmt::print(
      "tip        take a tip radius of at least {:.3g}{}, one edge: below, forces depend on the mesh\n",
      check.mean_edge, unit);
}

void print_parts(const CheckReport& report) {
  const OrganCheck& check = report.check;
  fmt::print(
      "parts      {}{}\n", check.parts.size(),
      check.parts.size() > 1 ? ": each needs supports of its own, unless they are meant to be joined" : "");
  fmt::print("held       {} nodes by {}\n", check.num_held_nodes,
             !report.held_by.empty() ? printable(report.held_by)
             : report.model->materials.empty()
                 ? "nothing; `palpate new` holds the lowest tenth, or the place of --fix"
                 : "nothing; add *BOUNDARY before the first *STEP");
  size_t shown = 0;
  for (const PartCheck& part : check.parts) {
    if (check.parts.size() == 1 && part.free_motions.empty()) continue;
    if (++shown > kMostListed) break;
    fmt::print(
        "           part with node {}: {} nodes, {} elements, {}; {}\n", part.first_node, part.num_nodes,
        part.num_elements, place_text(part.box),
        part.free_motions.empty() ? "held" : fmt::format("can {}", fmt::join(part.free_motions, ", ")));
  }
  if (shown > kMostListed) fmt::print("           ... and {} more\n", check.parts.size() - kMostListed);
}

void print_selected(const char* label, const std::optional<SelectedNodes>& nodes) {
  if (!nodes) return;
  fmt::print("{:<10} {} nodes, {} of them free on the surface: {}\n", label, nodes->num_nodes,
             nodes->num_touchable, place_text(nodes->box));
}

void print_laws(const Model& model) {
  const std::vector<int> counts = elements_of_materials(model);
  for (size_t i = 0; i < counts.size() && i < kMostListed; ++i) {
    const SmallStrainModuli moduli = small_strain_moduli(model.materials[i].law);
    fmt::print("{:<10} {}: {} elements, shear modulus {:.4g}, Poisson's ratio {:.4g}\n", i == 0 ? "laws" : "",
               printable(model.materials[i].name), counts[i], moduli.shear, moduli.poisson_ratio());
  }
  if (counts.size() > kMostListed) fmt::print("           ... and {} more\n", counts.size() - kMostListed);
  if (counts.empty())
    fmt::print("laws       none; `palpate new` gives it one, of --tissue or of the arrays E and nu\n");
}

void print_angles(const OrganCheck& check) {
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

// "0.3 s", "12 min", "7.5 h".
std::string duration_text(double seconds) {
  constexpr double kMinute = 60;
  constexpr double kHour = 3600;
  if (seconds < 2 * kMinute) return fmt::format("{:.2g} s", seconds);
  if (seconds < 2 * kHour) return fmt::format("{:.0f} min", seconds / kMinute);
  return fmt::format("{:.1f} h", seconds / kHour);
}

nlohmann::json box_json(const Eigen::AlignedBox3d& box) {
  return {{box.min().x(), box.min().y(), box.min().z()}, {box.max().x(), box.max().y(), box.max().z()}};
}

nlohmann::json selected_json(const SelectedNodes& nodes) {
  return {{"nodes", nodes.num_nodes}, {"touchable", nodes.num_touchable}, {"box", box_json(nodes.box)}};
}

nlohmann::json laws_json(const Model& model) {
  nlohmann::json laws = nlohmann::json::array();
  const std::vector<int> counts = elements_of_materials(model);
  for (size_t i = 0; i < counts.size(); ++i) {
    const SmallStrainModuli moduli = small_strain_moduli(model.materials[i].law);
    laws.push_back({{"name", model.materials[i].name},
                    {"elements", counts[i]},
                    {"shear_modulus", moduli.shear},
                    {"poisson_ratio", moduli.poisson_ratio()}});
  }
  return laws;
}

}  // namespace

void print_check_text(const CheckReport& report) {
  const OrganCheck& check = report.check;
  fmt::print("mesh       {}: {} nodes, {} elements{}\n", report.model->file, check.num_nodes,
             check.num_elements,
             check.num_quadratic > 0 ? fmt::format(", {} of ten nodes", check.num_quadratic) : "");
  fmt::print("size       {}\n", size_text(report));
  print_surface(report);
  print_parts(report);
  print_selected("--fix", report.fix);
  print_selected("--probe", report.probe);
  print_laws(*report.model);
  print_angles(check);
  for (const std::string& warning : check.warnings) fmt::print("warning    {}\n", warning);
  for (const std::string& fault : check.faults) fmt::print("refused    {}\n", fault);
  std::fflush(stdout);
}

void print_cost_text(const CheckReport& report) {
  if (!report.cost) {
    fmt::print("cost       not estimated: {}\n", report.cost_of);
    return;
  }
  const OrganCost& cost = *report.cost;
  fmt::print("cost       of {}, on this machine:\n", report.cost_of);
  fmt::print("           a solve of one push about {} and {:.0f} MB, on one thread\n",
             duration_text(cost.solve_seconds), std::max(1.0, cost.solve_bytes / 1e6));
  fmt::print(
      "           a build with {} sites about {} of one thread and {:.0f} MB, its pack {:.1f} MB; `--survey "
      "none` leaves "
      "out most of the "
      "time, and the errors\n",
      cost.num_sites, duration_text(cost.build_seconds), std::max(1.0, cost.build_bytes / 1e6),
      cost.pack_bytes / 1e6);
}

void print_check_json(const CheckReport& report) {
  const OrganCheck& check = report.check;
  const Eigen::Vector3d size = check.box.sizes();
  nlohmann::json parts = nlohmann::json::array();
  for (const PartCheck& part : check.parts)
    parts.push_back({{"first_node", part.first_node},
                     {"nodes", part.num_nodes},
                     {"elements", part.num_elements},
                     {"box", box_json(part.box)},
                     {"free_motions", part.free_motions}});
  nlohmann::json json = {{"file", report.model->file},
                         {"nodes", check.num_nodes},
                         {"elements", check.num_elements},
                         {"ten_node_elements", check.num_quadratic},
                         {"size", {size[0], size[1], size[2]}},
                         {"unit", report.unit == nullptr ? "" : report.unit->length},
                         {"surface_nodes", check.num_surface_nodes},
                         {"mean_surface_edge", check.mean_edge},
                         {"volume", check.volume},
                         {"shells", check.num_shells},
                         {"cavities", check.num_cavities},
                         {"open_edges", check.num_open_edges},
                         {"shared_nodes", check.num_shared_nodes},
                         {"least_tip_radius", check.mean_edge},
                         {"parts", parts},
                         {"held_nodes", check.num_held_nodes},
                         {"held_by", report.held_by},
                         {"laws", laws_json(*report.model)},
                         {"least_angle", check.least_angle},
                         {"largest_angle", check.largest_angle},
                         {"angles", check.angles},
                         {"slivers", check.num_slivers},
                         {"worst_elements", check.slivers},
                         {"notes", report.model->warnings},
                         {"warnings", check.warnings},
                         {"refused", check.faults}};
  if (report.fix) json["fix"] = selected_json(*report.fix);
  if (report.probe) json["probe"] = selected_json(*report.probe);
  if (report.cost) {
    json["cost"] = {{"of", report.cost_of},
                    {"solve_seconds", report.cost->solve_seconds},
                    {"solve_bytes", report.cost->solve_bytes},
                    {"sites", report.cost->num_sites},
                    {"build_bytes", report.cost->build_bytes},
                    {"build_seconds", report.cost->build_seconds},
                    {"pack_bytes", report.cost->pack_bytes}};
  } else {
    json["no_cost"] = report.cost_of;
  }
  fmt::print("{}\n", json_text(json));
}

}  // namespace palpate
