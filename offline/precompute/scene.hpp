// The scene file: contact sites, range and accuracy of an organ's pack.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

enum class Directions { all, inward };

// Storage of the compliance of linear_dd; automatic: dense where small enough.
enum class ComplianceForm { automatic, dense, compressed };

// Storage of the fields of polynomial_dd; rounded: int16; automatic: rounded where the target permits.
enum class FieldPrecision { automatic, real, rounded };

// Sampling and fit of polynomial_dd; paper_grid and paper_ray follow the paper (paper_quadratic.hpp).
enum class PolynomialMethod { hermite, paper_grid, paper_ray };

// Sites with nonlinear solves. fewest: where derivatives at rest miss the target; automatic for many sites.
enum class SampledSites { automatic, all, fewest };

struct Scene {
  std::filesystem::path file;
  std::filesystem::path model_file;  // relative to the folder of `file`
  std::string length_unit;           // "" = not stated: the runtime uses model units
  std::string force_unit;
  double metres_per_length_unit = 1;  // 1 when not stated
  double newtons_per_force_unit = 1;
  std::string kept_apart;  // counts of unjoined_counts() where separate_bodies = true; "" = none

  std::vector<int> sites;       // node indices in the model: touchable, free surface nodes, sorted
  double max_displacement = 0;  // length unit
  Directions directions = Directions::all;
  double tip_radius = 0;  // length unit
  int max_contacts = 1;

  bool embed_inputs = true;       // the pack carries the bytes of the scene and of the model
  std::vector<int> output_nodes;  // node indices of shown nodes, sorted; includes every node of a patch
  double accuracy_target = 0.01;  // for the survey's p95 displacement error
  double frame_budget_us = 100;
  std::optional<Eigen::Vector3d> gravity;  // acceleration, length unit / time unit^2
  bool gravity_may_turn = false;           // the device may tilt the organ
  bool linear = true;                      // carry linear_dd
  ComplianceForm compliance = ComplianceForm::automatic;
  bool polynomial = true;  // carry polynomial_dd
  PolynomialMethod polynomial_method = PolynomialMethod::hermite;
  SampledSites sampled_sites = SampledSites::automatic;
  FieldPrecision precision = FieldPrecision::automatic;
  std::optional<bool> zone;  // carry nonlinear_zone; unset: for several contacts within the budget
  int zone_rings = 0;        // 0: chosen by the budget
};

// Whether a pack stores the fields of polynomial_dd as int16. The rounding error, which grows with the aspect
// ratio of the domain, must stay small beside the target.
bool rounds_fields(const Scene& scene);

// A scene and its model, checked against each other.
struct LoadedScene {
  Scene scene;
  Model model;
};

// Reads SCENE.toml (docs/scene_file.md) and its model. Throws InputError with file and line for unknown keys,
// wrong types, missing sets, and sites on fixed nodes or off the surface. `include_root`: as in read_inp().
LoadedScene read_scene(const std::filesystem::path& file, const std::filesystem::path& include_root = {});

}  // namespace palpate
