// The scene file: which part of an organ a tool may touch, how far, and how well it must be answered.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

enum class Directions { all, inward };

// How linear_dd keeps the compliance; automatic: dense where that is small enough.
enum class ComplianceForm { automatic, dense, compressed };

// How polynomial_dd and nonlinear_zone keep their fields; automatic: rounded where that leaves the target alone.
enum class FieldPrecision { automatic, real, rounded };

// How polynomial_dd samples and fits; all but the first as the paper does (paper_quadratic.hpp).
enum class PolynomialMethod { hermite, paper_grid, paper_ray };

// At which sites solves are made for polynomials; fewest: where derivatives at rest alone do not keep the target;
// automatic: fewest of a whole surface, all of some sites.
enum class SampledSites { automatic, all, fewest };

struct Scene {
  std::filesystem::path file;
  std::filesystem::path model_file;  // resolved against the folder of `file`
  std::string length_unit;           // "" = not stated, then the runtime speaks model units
  std::string force_unit;
  double metres_per_length_unit = 1;  // 1 when not stated
  double newtons_per_force_unit = 1;

  std::vector<int> sites;       // node indices in the model: touchable surface nodes, sorted, not fixed
  double max_displacement = 0;  // length unit
  Directions directions = Directions::all;
  double tip_radius = 0;  // length unit
  int max_contacts = 1;

  std::vector<int> output_nodes;  // node indices the scene shows, sorted; always holds every node of a patch
  double accuracy_target = 0.01;  // of the survey's p95 displacement error
  double frame_budget_us = 100;
  std::optional<Eigen::Vector3d> gravity;  // acceleration, length unit / time unit^2
  bool gravity_may_turn = false;           // the device may tilt the organ
  bool linear = true;                      // carry linear_dd
  ComplianceForm compliance = ComplianceForm::automatic;
  bool polynomial = true;  // carry polynomial_dd
  PolynomialMethod polynomial_method = PolynomialMethod::hermite;
  SampledSites sampled_sites = SampledSites::automatic;
  FieldPrecision precision = FieldPrecision::automatic;
  std::optional<bool>
      zone;  // carry nonlinear_zone; unset: where several contacts are to be answered within the budget
  int zone_rings = 0;  // 0: chosen by what they take
};

// Whether a pack has its nonlinear fields as int16. With their weights they are wrong by 3e-5 of |d| together (fields of the
// brain beside those of float32), by more where a domain is longer than wide and for each contact of several: little beside
// a target of ten times that and more.
bool rounds_fields(const Scene& scene);

// A scene and the model it names, both checked against each other.
struct LoadedScene {
  Scene scene;
  Model model;
};

// Reads SCENE.toml (DESIGN section "Scene file") and its model. Unknown keys, wrong types, missing sets, a
// site on a fixed node or off the surface: InputError naming file and line.
LoadedScene read_scene(const std::filesystem::path& file);

}  // namespace palpate
