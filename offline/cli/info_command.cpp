// palpate info and palpate verify: show the content of a pack, and check that a runtime opens the pack.
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "offline/cli/commands.hpp"
#include "offline/cli/json_text.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/pipeline/organ_size.hpp"
#include "offline/pipeline/survey_table.hpp"
#include "offline/precompute/site_survey.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

struct InfoArguments {
  std::filesystem::path pack;
  bool json = false;
};

size_t default_arena_bytes(const OpenedPack& opened) {
  const pal_session_config config = pal_default_session_config(opened.pack().get());
  size_t bytes = 0;
  require_ok(Session::required_bytes(opened.pack(), config, bytes), "session");
  return bytes;
}

size_t model_bytes(const pack::Pack& tables, pack::ResponseModel model) {
  if (model == pack::ResponseModel::linear_dd) {
    if (const pack::CompressedCompliance* compressed = tables.linear_dd()->compressed()) {
      return compressed->panels()->bytes() + compressed->node_places()->bytes() +
             compressed->basis()->bytes() + compressed->blocks()->bytes() +
             compressed->coefficients()->bytes();
    }
    return tables.linear_dd()->contact_compliance()->bytes() +
           tables.linear_dd()->field_compliance()->bytes();
  }
  if (model == pack::ResponseModel::nonlinear_zone) {
    const pack::Organ& organ = *tables.organ();
    return tables.nonlinear_zone()->materials()->bytes() + organ.nodes()->bytes() +
           organ.elements()->bytes() + organ.node_elements()->bytes() + organ.fronts()->bytes() +
           organ.order()->bytes() + organ.rows()->bytes();
  }
  const pack::PolynomialDd& polynomial = *tables.polynomial_dd();
  return polynomial.sites()->bytes() + polynomial.energy()->bytes() + polynomial.coefficients()->bytes() +
         polynomial.field()->bytes();
}

// Returns the bytes of surface_bvh; 0 for a pack of an older builder, which has no such table.
size_t surface_bytes(const pack::Pack& tables) {
  const pack::SurfaceBvh* surface = tables.surface_bvh();
  if (surface == nullptr) return 0;
  return surface->primitives()->bytes() + surface->nodes()->bytes() + surface->primitive_normals()->bytes() +
         surface->site_normals()->bytes();
}

std::span<const pack::PolynomialSite> polynomial_sites(const OpenedPack& opened) {
  const pack::PolynomialDd* polynomial = opened.tables().polynomial_dd();
  return polynomial == nullptr ? std::span<const pack::PolynomialSite>()
                               : opened.segment<pack::PolynomialSite>(*polynomial->sites());
}

// Returns the least |d| on the boundary of the sampled domain, length unit.
double sampled_reach(const pack::PolynomialSite& site) {
  return least_reach(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(site.to_unit));
}

const char* precision_name(pack::FieldPrecision precision) {
  if (precision == pack::FieldPrecision::i16) return "i16";
  return sizeof(pack::Real) == sizeof(float) ? "f32" : "f64";
}

// Formats a range: "3 to 5", or "4" where all values are equal.
template <typename Member>
std::string range_of(std::span<const pack::PolynomialSite> sites, Member member) {
  const auto [least, most] = std::minmax_element(
      sites.begin(), sites.end(), [&](const auto& a, const auto& b) { return a.*member < b.*member; });
  return (*least).*member == (*most).*member ? fmt::format("{}", (*least).*member)
                                             : fmt::format("{} to {}", (*least).*member, (*most).*member);
}

void print_polynomials(const OpenedPack& opened) {
  const std::span<const pack::PolynomialSite> sites = polynomial_sites(opened);
  if (sites.empty()) return;
  double reach = std::numeric_limits<double>::infinity();
  double min_jacobian = 1;
  double basis_error = 0;
  const double full = opened.tables().sites()->max_displacement();
  int shorter = 0;
  for (const pack::PolynomialSite& site : sites) {
    if (site.samples > 0) reach = std::min(reach, sampled_reach(site));
    min_jacobian = std::min(min_jacobian, site.min_jacobian);
    basis_error = std::max(basis_error, site.basis_error);
    shorter += is_shortened(sampled_reach(site), full) ? 1 : 0;
  }
  const std::string sampled =
      std::isinf(reach)
          ? ""
          : fmt::format("sampled at least to |d| = {:.4g}{} ({:.2f} h); ", reach, opened.length_suffix(),
                        reach / opened.tables().geometry()->mean_surface_edge());
  fmt::print("  polynomials    degree {}, from {} solves a site; {}smallest J (volume ratio) {:.3f}\n",
             range_of(sites, &pack::PolynomialSite::degree), range_of(sites, &pack::PolynomialSite::samples),
             sampled, min_jacobian);
  const auto unsampled =
      std::count_if(sites.begin(), sites.end(), [](const auto& site) { return site.samples == 0; });
  if (unsampled > 0) {
    fmt::print("                 affine_site serves the {} of {} sites without samples\n", unsampled,
               sites.size());
  }
  fmt::print("                 fields in a basis of {} columns ({}), within {:.2g} % of |d| of the fit\n",
             range_of(sites, &pack::PolynomialSite::rank),
             precision_name(opened.tables().polynomial_dd()->precision()), 100 * basis_error);
  if (shorter > 0) {
    fmt::print(
        "                 {} sites are sampled less far than |d| = {:.4g}{} in some directions; causes:\n"
        "                 no equilibrium, a second equilibrium branch, a nearly inverted element, or a poor "
        "polynomial fit\n",
        shorter, full, opened.length_suffix());
  }
}

nlohmann::json sites_json(const OpenedPack& opened) {
  const pack::ContactSites& sites = *opened.tables().sites();
  const std::span<const std::uint32_t> starts = opened.segment(*sites.patch_starts());
  const std::span<const std::uint32_t> members = opened.segment(*sites.patch_nodes());
  const std::span<const std::uint32_t> contact_nodes = opened.segment(*sites.contact_nodes());
  const std::int32_t* labels = opened.pack().geometry().labels;
  const std::span<const pack::PolynomialSite> polynomials = polynomial_sites(opened);
  const double h = opened.tables().geometry()->mean_surface_edge();
  nlohmann::json list = nlohmann::json::array();
  for (size_t site = 0; site < sites.num_sites(); ++site) {
    nlohmann::json patch = nlohmann::json::array();
    for (std::uint32_t i = starts[site]; i < starts[site + 1]; ++i)
      patch.push_back(labels[contact_nodes[members[i]]]);
    list.push_back({{"node", opened.label_of_site(site)}, {"patch", patch}});
    if (polynomials.empty()) continue;
    const pack::PolynomialSite& polynomial = polynomials[site];
    list.back().update({{"sampled_to", sampled_reach(polynomial)},
                        {"sampled_to_over_h", sampled_reach(polynomial) / h},
                        {"min_J", polynomial.min_jacobian},
                        {"samples", polynomial.samples},
                        {"degree", polynomial.degree},
                        {"rank", polynomial.rank},
                        {"basis_error", polynomial.basis_error}});
  }
  return list;
}

// Lists the first labels that --contact takes.
std::string site_labels(const OpenedPack& opened) {
  constexpr size_t kShown = 12;
  const size_t count = opened.info().num_sites;
  std::string text;
  for (size_t site = 0; site < std::min(count, kShown); ++site)
    text += fmt::format("{}{}", site > 0 ? ", " : "", opened.label_of_site(site));
  if (count > kShown) text += fmt::format(", ... (all {} with --json)", count);
  return text;
}

// Returns null for a pack without gravity.
nlohmann::json gravity_json(const OpenedPack& opened) {
  const pack::Gravity* gravity = opened.tables().gravity();
  if (gravity == nullptr) return nullptr;
  return {{"acceleration", opened.segment<double>(*gravity->acceleration())},
          {"may_turn", opened.info().gravity_may_turn != 0}};
}

nlohmann::json inputs_json(const pack::Pack& tables) {
  nlohmann::json inputs = nlohmann::json::array();
  for (const pack::InputFile* input : *tables.inputs()) {
    inputs.push_back({{"name", input->name()->str()}, {"xxh3_128", input->xxh3_128()->str()}});
  }
  return inputs;
}

nlohmann::json models_json(const pack::Pack& tables) {
  nlohmann::json models = nlohmann::json::object();
  for (const pack::FrameCost* cost : *tables.costs()) {
    models[pack::EnumNameResponseModel(cost->model())] = {{"bytes", model_bytes(tables, cost->model())},
                                                          {"force_operations", cost->force_operations()},
                                                          {"force_bytes", cost->force_bytes()},
                                                          {"field_operations", cost->field_operations()},
                                                          {"field_bytes", cost->field_bytes()}};
  }
  if (const pack::NonlinearZone* zone = tables.nonlinear_zone(); zone != nullptr) {
    models["nonlinear_zone"].update({{"rings", zone->rings()},
                                     {"nodes", zone->num_nodes()},
                                     {"elements", zone->num_elements()},
                                     {"most_nodes", zone->most_nodes()},
                                     {"most_boundary_nodes", zone->most_boundary_nodes()},
                                     {"most_elements", zone->most_elements()}});
  }
  if (tables.polynomial_dd() != nullptr) {
    models["polynomial_dd"]["degree"] = tables.polynomial_dd()->degree();
    models["polynomial_dd"]["precision"] = precision_name(tables.polynomial_dd()->precision());
  }
  return models;
}

nlohmann::json info_json(const OpenedPack& opened) {
  const pack::Pack& tables = opened.tables();
  const pal_pack_info info = opened.info();
  const pack::Geometry& geometry = *tables.geometry();
  return {{"tool_version", tables.tool_version()->str()},
          {"bytes", opened.bytes().size()},
          {"arena_bytes", default_arena_bytes(opened)},
          {"inputs", inputs_json(tables)},
          {"units", {{"length", opened.length_unit()}, {"force", opened.force_unit()}}},
          {"gravity", gravity_json(opened)},
          {"model_nodes", geometry.num_model_nodes()},
          {"model_elements", geometry.num_model_elements()},
          {"packed_nodes", geometry.num_nodes()},
          {"triangles", geometry.num_triangles()},
          {"mean_surface_edge", geometry.mean_surface_edge()},
          {"contact_nodes", info.num_contact_nodes},
          {"tip_radius", tables.sites()->tip_radius()},
          {"tip_below_edge", is_tip_below_edge(tables.sites()->tip_radius(), geometry.mean_surface_edge())},
          {"max_displacement", tables.sites()->max_displacement()},
          {"max_contacts", info.max_contacts},
          {"directions", tables.sites()->inward_normals() != nullptr ? "inward" : "all"},
          {"surface_bvh", {{"bytes", surface_bytes(tables)}}},
          {"models", models_json(tables)},
          {"compliance", compliance_json(tables)},
          {"errors", survey_json(surveys_of(tables))},
          {"sites", sites_json(opened)}};
}

void print_organ(const OpenedPack& opened) {
  const pack::Pack& tables = opened.tables();
  const pal_pack_info info = opened.info();
  const pack::Geometry& geometry = *tables.geometry();
  const std::string length = opened.length_suffix();
  if (opened.length_unit().empty()) {
    fmt::print("  units          not stated: the runtime uses the model's own units\n");
  } else {
    fmt::print("  units          {} and {} in the model; the runtime uses m and N\n", opened.length_unit(),
               opened.force_unit());
  }
  if (info.has_gravity != 0) {
    const std::span<const double> g = opened.segment<double>(*tables.gravity()->acceleration());
    fmt::print("  gravity        ({:.6g}, {:.6g}, {:.6g}){}\n", g[0], g[1], g[2],
               info.gravity_may_turn != 0 ? ", may turn" : "");
  }
  fmt::print(
      "  organ          {} nodes, {} elements; {} nodes and {} triangles shown; "
      "h (mean surface edge) = {:.4g}{}\n",
      geometry.num_model_nodes(), geometry.num_model_elements(), geometry.num_nodes(),
      geometry.num_triangles(), geometry.mean_surface_edge(), length);
  fmt::print(
      "  contacts       {} sites, patches of up to {} nodes (tip radius {:.4g}{}); "
      "|d| (tool displacement) up to {:.4g}{}; {} at once\n",
      info.num_sites, info.max_patch_nodes, tables.sites()->tip_radius(), length,
      tables.sites()->max_displacement(), length, info.max_contacts);
  if (is_tip_below_edge(tables.sites()->tip_radius(), geometry.mean_surface_edge()))
    fmt::print("                 {}\n",
               tip_text(tables.sites()->tip_radius(), geometry.mean_surface_edge(), length));
  fmt::print("  site nodes     {}\n", site_labels(opened));
}

void print_models(const OpenedPack& opened) {
  const pack::Pack& tables = opened.tables();
  print_polynomials(opened);
  if (const pack::NonlinearZone* zone = tables.nonlinear_zone()) {
    fmt::print(
        "  zones          up to {} {} of elements; {} nodes, {} elements; "
        "a site's zone has up to {} nodes, {} elements\n",
        zone->rings(), zone->rings() == 1 ? "ring" : "rings", zone->num_nodes(), zone->num_elements(),
        zone->most_nodes(), zone->most_elements());
  }
  if (const pack::SurfaceBvh* surface = tables.surface_bvh()) {
    fmt::print(
        "  surface_bvh    {:.2f} MB; {} primitives (triangles, and sites without a triangle) in {} boxes\n",
        static_cast<double>(surface_bytes(tables)) / 1e6, surface->num_primitives(), surface->num_nodes());
  }
  if (tables.linear_dd() != nullptr) {
    if (const pack::CompressedCompliance* compressed = tables.linear_dd()->compressed()) {
      fmt::print(
          "  compliance     compressed to a tolerance of {:g}; largest errors over {} sets of contacts:\n"
          "                 displacements {:.2g} of the largest |d|, forces {:.2g} of the largest force\n",
          compressed->tolerance(), compressed->samples(), compressed->displacement_error(),
          compressed->force_error());
    } else {
      fmt::print("  compliance     dense\n");
    }
  }
  for (const pack::FrameCost* cost : *tables.costs()) {
    fmt::print("  {:<14} {:.2f} MB; worst frame: force {} multiply-adds, {} bytes read; field {} and {}\n",
               pack::EnumNameResponseModel(cost->model()),
               static_cast<double>(model_bytes(tables, cost->model())) / 1e6, cost->force_operations(),
               cost->force_bytes(), cost->field_operations(), cost->field_bytes());
  }
}

void print_info(const OpenedPack& opened, const std::filesystem::path& file) {
  const pack::Pack& tables = opened.tables();
  fmt::print("{}: built by Palpate {}\n", file.string(), tables.tool_version()->str());
  for (const pack::InputFile* input : *tables.inputs())
    fmt::print("  input          {} (XXH3-128 {})\n", input->name()->str(), input->xxh3_128()->str());
  fmt::print("  size           {:.2f} MB; a session's arena takes {} bytes\n",
             static_cast<double>(opened.bytes().size()) / 1e6, default_arena_bytes(opened));
  print_organ(opened);
  print_models(opened);
  const std::vector<ModelErrors> surveys = surveys_of(tables);
  fmt::print("\n{}", survey_text(surveys));
  if (const std::string sets = set_survey_text(surveys); !sets.empty()) fmt::print("\n{}", sets);
}

int run_info(const InfoArguments& arguments) {
  const OpenedPack opened(arguments.pack);
  if (arguments.json) {
    fmt::print("{}\n", json_text(info_json(opened)));
  } else {
    print_info(opened, arguments.pack);
  }
  return 0;
}

int run_verify(const InfoArguments& arguments) {
  // The constructor checks the pack as a runtime does, and throws where a check fails.
  const OpenedPack opened(arguments.pack);
  if (arguments.json) {
    fmt::print(
        "{}\n",
        json_text({{"pack", arguments.pack.string()}, {"bytes", opened.bytes().size()}, {"valid", true}}));
  } else {
    fmt::print("{}: valid ({} bytes)\n", arguments.pack.string(), opened.bytes().size());
  }
  return 0;
}

}  // namespace

void add_info_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command =
      app.add_subcommand("info", "Print what is in a pack: models, sites, bytes, errors, costs, inputs");
  command->footer(
      "Site nodes are what `palpate eval --contact` takes; errors are percent, against full nonlinear "
      "solves.\n\n"
      "Example: palpate info brain.pack --json");
  command->add_option("PACK", arguments->pack, "Pack made by `palpate build`")->type_name("")->required();
  command->add_flag("--json", arguments->json, "Print as JSON, with every site and its patch");
  command->callback([arguments, &exit_code] { exit_code = run_info(*arguments); });
}

void add_verify_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command = app.add_subcommand("verify", "Check a pack's structure, meaning and checksum");
  command->footer(
      "Exit code 0 only if a runtime would open the pack.\n\n"
      "Example: palpate verify brain.pack");
  command->add_option("PACK", arguments->pack, "Pack made by `palpate build`")->type_name("")->required();
  command->add_flag("--json", arguments->json, "Print as JSON");
  command->callback([arguments, &exit_code] { exit_code = run_verify(*arguments); });
}

}  // namespace palpate
