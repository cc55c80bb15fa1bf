#include "offline/pipeline/build_plan.hpp"

#include <fmt/core.h>
#include <palpate/palpate.h>

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <variant>

#include "offline/mesh/volume_patches.hpp"
#include "offline/pack/pack_writer.hpp"
#include "offline/pipeline/organ_size.hpp"
#include "offline/precompute/organ_tree.hpp"
#include "offline/precompute/paper_quadratic.hpp"

namespace palpate {
namespace {

// Limit of a dense compliance, which opens fast and is exact. Bytes grow with the square of the nodes.
constexpr double kMostDenseBytes = 256e6;
// The same where the linear model answers only until a zone is prepared: a smaller pack matters more.
constexpr double kMostBridgingBytes = 16e6;

double dense_bytes(const ContactSites& sites) {
  return dense_compliance_bytes(sites.packed_nodes.size(), sites.contact_nodes.size());
}

constexpr size_t kChecksOfSeries = 2;  // check solves at a site without samples
// Survey targets from this value down need more samples and higher degrees.
constexpr double kFineTarget = 1e-3;

// Rings of elements about the contacts, unless the budget allows only one ring. Before the refining lane has
// corrected the exterior, the error of two rings is half the error of one ring (docs/response_models.md).
constexpr int kMostRings = 2;

// Estimates the least number of fitted solves at a site.
size_t samples_of_site(const Scene& scene, const SamplingPlan& plan) {
  if (!scene.polynomial) return 0;
  const bool half = scene.directions == Directions::inward;
  switch (scene.polynomial_method) {
    case PolynomialMethod::hermite:
      return plan.fewest ? kChecksOfSeries : plan.least_samples;
    case PolynomialMethod::paper_grid:
      return grid_points(half).size();
    case PolynomialMethod::paper_ray:
      return ray_points(Eigen::Vector3d::UnitZ()).size();
  }
  return 0;
}

bool is_nonlinear(const Model& model) {
  return std::any_of(model.materials.begin(), model.materials.end(), [](const Material& material) {
    return !std::holds_alternative<LinearElastic>(material.law);
  });
}

// Estimates the time of a frame. Each moving contact has a zone, or half of a shared zone, and needs:
//   1. one iteration with substitutions and products,
//   2. two evaluations of its elements,
//   3. a tenth of the next tangent.
double zone_frame_us(const ZoneTables& zone, int contacts) {
  constexpr double kOperationsPerMicrosecond = 8000;  // multiply-adds of an ordinary core
  constexpr double kPerElement = 1200;                // multiply-adds of two evaluations of an element
  constexpr double kPerStiffness = 3000;              // multiply-adds of an element stiffness
  const double m = 3.0 * zone.most_nodes;
  const double tangent = m * m * m / 6 + 8 * m * m + kPerStiffness * zone.most_elements;
  const double operations = 2 * m * m + tangent / 10 + kPerElement * zone.most_elements;
  return std::min(contacts, static_cast<int>(pack::kMostZoneContacts)) * operations /
         kOperationsPerMicrosecond;
}

bool is_zone_wanted(const Model& model, const Scene& scene) {
  const bool is_useful =
      scene.max_contacts > 1 && scene.linear && is_nonlinear(model) && !shares_linear_volumes(model);
  return scene.zone.value_or(is_useful);
}

void print_compliance(const Scene& scene, const ContactSites& sites) {
  if (!has_compliance(scene)) return;
  const double dense = dense_bytes(sites) / 1e6;
  if (is_to_be_compressed(scene, sites)) {
    fmt::print("compliance compressed, entries right to {:g}; dense it would take {:.1f} MB\n",
               compliance_tolerance(scene), dense);
  } else {
    fmt::print("compliance dense, {:.1f} MB\n", dense);
  }
}

void print_volumes(const Model& model, const Scene& scene) {
  const VolumePatchCount patches = count_volume_patches(model);
  if (patches.patches == 0) return;
  fmt::print("volumes    {} shared by {} to {} elements each{}\n", patches.patches, patches.fewest_elements,
             patches.most_elements,
             scene.max_contacts > 1 && shares_linear_volumes(model)
                 ? "; nonlinear zones do not support small-strain *ELASTIC and are left out"
                 : "");
}

// Prints the planned zones, or why the pack has none. Returns the bytes that zones add to the pack.
double print_zones(const Model& model, const Scene& scene, const ContactSites& sites) {
  if (const std::optional<ZoneTables> zone = plan_zone(model, scene, sites)) {
    const double organ_size = organ_bytes(model);
    fmt::print(
        "zones      {} ring{}: {} nodes, {} elements, {:.1f} MB; of a site up to {} nodes, {} elements{}\n",
        zone->rings, zone->rings > 1 ? "s" : "", zone->num_nodes, zone->num_elements, organ_size / 1e6,
        zone->most_nodes, zone->most_elements,
        scene.max_contacts > static_cast<int>(pack::kMostZoneContacts)
            ? fmt::format("; more than {} contacts at once are answered by the linear model",
                          pack::kMostZoneContacts)
            : "");
    return organ_size;
  }
  if (is_zone_wanted(model, scene))
    fmt::print(
        "zones      none: one ring would take more than [budget] frame_us = {:g}; several contacts are "
        "answered by the linear model\n",
        scene.frame_budget_us);
  return 0;
}

}  // namespace

bool has_compliance(const Scene& scene) {
  return scene.linear || scene.zone.value_or(false);
}

bool is_to_be_compressed(const Scene& scene, const ContactSites& sites) {
  if (!has_compliance(scene) || scene.compliance == ComplianceForm::dense) return false;
  return scene.compliance == ComplianceForm::compressed ||
         dense_bytes(sites) > (scene.linear ? kMostDenseBytes : kMostBridgingBytes);
}

double compliance_tolerance(const Scene& scene) {
  return scene.linear ? kComplianceTolerance : kBridgingTolerance;
}

bool is_dense_at_hand(const Scene& scene, const ContactSites& sites) {
  return !is_to_be_compressed(scene, sites) &&
         (has_compliance(scene) || dense_bytes(sites) <= kMostDenseBytes);
}

std::optional<ZoneTables> plan_zone(const Model& model, const Scene& scene, const ContactSites& sites) {
  if (!is_zone_wanted(model, scene)) return std::nullopt;
  if (scene.zone_rings > 0) return find_zones(model, sites, scene.zone_rings);
  for (int rings = kMostRings; rings > 0; --rings) {
    ZoneTables zone = find_zones(model, sites, rings);
    if (scene.zone.value_or(false) || zone_frame_us(zone, scene.max_contacts) <= scene.frame_budget_us)
      return zone;
  }
  return std::nullopt;
}

SamplingPlan plan_sampling(const Scene& scene, const ContactSites& sites, int jobs) {
  SamplingPlan plan;
  plan.jobs = jobs;
  // 60 samples bound the p95 with a confidence of 95 %.
  constexpr int kSurveySets = 60;
  plan.survey_sets = scene.max_contacts > 1 && has_compliance(scene) ? kSurveySets : 0;
  plan.target = scene.accuracy_target;
  // Slivers under a small tip need more solves (bench/polynomials/POLYNOMIALS.md).
  constexpr size_t kSolvesForFineTargets = 150;
  // Inward directions stay at degree 7 or below, for which 60 solves suffice.
  if (plan.target <= kFineTarget && scene.directions != Directions::inward)
    plan.most_samples = kSolvesForFineTargets;
  plan.rounded = rounds_fields(scene);
  // Below this reach rounding of energies and forces spoils the fit.
  constexpr double kLeastReach = 1e-6;  // fraction of h
  if (scene.polynomial && scene.max_displacement < kLeastReach * sites.mean_surface_edge) {
    throw std::runtime_error(fmt::format(
        "{}: max_displacement = {:g} is below a millionth of the mean surface edge {:.4g}, too little for a "
        "nonlinear model; raise it, or write [models] polynomial = false",
        scene.file.string(), scene.max_displacement, sites.mean_surface_edge));
  }
  // Many sites get the solves that their target needs. Few sites get more: the additional solves are cheap.
  constexpr int kManySites = 240;
  // With few sites each bin still needs 60 samples for its p95 at a confidence of 95 %.
  constexpr int kFewestSurveySolves = 4 * 60;
  const int num_sites = static_cast<int>(sites.sites.size());
  plan.fewest = scene.polynomial && scene.polynomial_method == PolynomialMethod::hermite &&
                (scene.sampled_sites == SampledSites::fewest ||
                 (scene.sampled_sites == SampledSites::automatic && num_sites > kManySites));
  plan.least_survey = plan.fewest ? kFewestSurveySolves / 4 : 0;
  int num_surveyed = num_sites;
  if (!scene.polynomial && num_sites > kFewestSurveySolves / 4) {
    // Without fits the survey would dominate the build: survey some sites, with one push in each bin.
    num_surveyed = plan.survey_sites = kFewestSurveySolves / 4;
    plan.survey_samples = 4;
  }
  if (scene.polynomial && num_sites > kManySites) {
    // Sites that miss the target after these solves get more (bench/polynomials/POLYNOMIALS.md).
    plan.least_samples = 4;
    plan.survey_samples = 2;
    return plan;
  }
  plan.survey_samples =
      std::max(plan.survey_samples, (kFewestSurveySolves / 4 + num_surveyed - 1) / num_surveyed * 4);
  return plan;
}

SamplingPlan plan_without_survey(const Scene& scene, const ContactSites& sites, int jobs) {
  if (scene.polynomial) {
    throw std::runtime_error(scene.file.string() +
                             ": --survey none needs [models] polynomial = false, as the survey decides how "
                             "polynomials are fitted");
  }
  SamplingPlan plan = plan_sampling(scene, sites, jobs);
  plan.survey_samples = plan.survey_sets = plan.least_survey = 0;
  return plan;
}

size_t num_worked(const SamplingPlan& plan, const ContactSites& sites) {
  return plan.survey_sites > 0 ? static_cast<size_t>(plan.survey_sites) : sites.sites.size();
}

std::vector<ContactSet> surveyed_sets(const Model& model, const Scene& scene, const ContactSites& sites,
                                      const SamplingPlan& plan) {
  constexpr std::uint64_t kSeed = 0;
  return draw_contact_sets(model, scene, sites, plan.survey_sets, kSeed);
}

std::string what_samples_depend_on(const Model& model, const Scene& scene, const ContactSites& sites,
                                   const std::vector<InputFile>& inputs) {
  // Another build of this program may differ in the last digit or by a corrected fault.
  const std::string program = read_inputs({"/proc/self/exe"}).front().hash;
  // Builds with few sampled sites have another order of pushes. A solve starts from the nearest solved push.
  std::string key = fmt::format("{} {:a} {:a} {} {} {}", program, scene.max_displacement, scene.tip_radius,
                                static_cast<int>(scene.directions), static_cast<int>(scene.polynomial_method),
                                plan_sampling(scene, sites, 1).fewest);
  if (model.merge_length > 0) key += fmt::format(" merge {:a}", model.merge_length);
  for (size_t i = 1; i < inputs.size(); ++i) key += " " + inputs[i].hash;  // the first input is the scene
  if (scene.gravity) {
    for (const double component : *scene.gravity) key += fmt::format(" {:a}", component);
  }
  for (const int node : sites.packed_nodes)
    key += fmt::format(" {}", model.labels[static_cast<size_t>(node)]);
  return key;
}

double sample_store_bytes(const Model& model, const Scene& scene, const ContactSites& sites,
                          const SamplingPlan& plan) {
  const double rows = 3.0 * static_cast<double>(sites.packed_nodes.size());
  // A sample has displacement and three derivatives of all dofs, and six second derivatives of packed rows.
  const double sample = 4.0 * model.num_dofs() + 6.0 * rows;
  return sizeof(float) *
         (static_cast<double>(num_worked(plan, sites)) *
              (static_cast<double>(samples_of_site(scene, plan)) * sample + plan.survey_samples * rows) +
          plan.survey_sets * rows);
}

// Lists the files whose bytes go into the pack, for a user who gives the pack to others.
std::string embedded_names(const Scene& scene, const std::vector<InputFile>& inputs) {
  if (!scene.embed_inputs) return "no input file (embed_inputs = false)";
  std::string names;
  for (const InputFile& input : inputs) names += (names.empty() ? "" : ", ") + input.path;
  return names;
}

double planned_bytes(const Scene& scene, const ContactSites& sites, const SamplingPlan& plan) {
  const PolynomialSize usual = plan.target <= kFineTarget ? PolynomialSize{7, 28} : PolynomialSize{5, 18};
  return estimate_pack_bytes(sites, has_compliance(scene), scene.polynomial ? usual : PolynomialSize(),
                             plan.rounded,
                             is_to_be_compressed(scene, sites) ? compliance_tolerance(scene) : 0);
}

PlannedWork planned_work(const Model& model, const Scene& scene, const ContactSites& sites,
                         const SamplingPlan& plan, bool has_zones) {
  return {num_worked(plan, sites),
          samples_of_site(scene, plan),
          static_cast<size_t>(plan.survey_samples),
          surveyed_sets(model, scene, sites, plan).size(),
          plan.fewest,
          has_zones && plan.survey_samples > 0};
}

void print_plan(const Scene& scene, const ContactSites& sites, const Assembly& assembly,
                const RestState& rest, const std::vector<InputFile>& inputs, const SamplingPlan& plan,
                int processes, bool keeps_samples) {
  const Model& model = assembly.model();
  double bytes = planned_bytes(scene, sites, plan);
  for (const InputFile& input : inputs)
    bytes += scene.embed_inputs ? static_cast<double>(input.contents.size()) : 0;
  fmt::print("model      {}: {} nodes, {} elements, {} equations, mean surface edge h = {:.4g}\n", model.file,
             model.num_nodes(), model.elements.size(), assembly.num_equations(), sites.mean_surface_edge);
  if (!scene.kept_apart.empty())
    fmt::print("bodies     not joined where they meet, as separate_bodies = true says: {}\n",
               scene.kept_apart);
  fmt::print("embeds     {}\n", embedded_names(scene, inputs));
  fmt::print("scene      {} sites, {} contact nodes, {} shown nodes; {}\n", sites.sites.size(),
             sites.contact_nodes.size(), sites.packed_nodes.size(),
             size_text(scene, model, sites.mean_surface_edge));
  print_compliance(scene, sites);
  print_volumes(model, scene);
  const double zone_bytes = print_zones(model, scene, sites);
  std::fflush(stdout);  // the user must see the plan before the wait, also in a file
  const PlannedWork work = planned_work(model, scene, sites, plan, zone_bytes > 0);
  const size_t solves = work.sets + work.sites * (work.samples_per_site + work.survey_per_site);
  std::string time = "no nonlinear solves";  // then the estimate would take longer than what it estimates
  if (solves > 0) {
    const int jobs = std::min(plan.jobs * processes, static_cast<int>(work.sites));
    const double seconds = estimate_build_time(assembly, scene, sites, rest, plan, work).build_seconds / jobs;
    time = fmt::format("{} nonlinear solves or more, about {:.{}f} s on {} threads", solves, seconds,
                       seconds < 10 ? 1 : 0, jobs);
  }
  fmt::print("estimate   {}; pack about {:.1f} MB", time, (bytes + zone_bytes) / 1e6);
  if (keeps_samples) fmt::print(", samples {:.1f} MB", sample_store_bytes(model, scene, sites, plan) / 1e6);
  fmt::print("\n");
  std::fflush(stdout);
}

}  // namespace palpate
