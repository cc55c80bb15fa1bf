// Page of paths past limit points: their cost, and their distance from references.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/solver/validation.hpp"
#include "tests/support/arch_rod.hpp"
#include "tests/support/elastica.hpp"
#include "tests/support/limit_scenes.hpp"

namespace palpate::study {
namespace {

using test::PathRun;
using test::PathScene;

// Returns force(w) / `unit` at its maximum and the following minimum, for deflections w from 0 to `furthest`.
template <typename Force>
std::pair<double, double> limits_of(Force&& force, double furthest, double unit) {
  constexpr int kSteps = 2000;
  std::vector<double> factors;
  for (int i = 0; i <= kSteps; ++i) factors.push_back(force(furthest * i / kSteps) / unit);
  size_t top = 1;
  while (top + 1 < factors.size() && factors[top + 1] > factors[top]) ++top;
  const auto from_top = factors.begin() + static_cast<std::ptrdiff_t>(top);
  return {factors[top], *std::min_element(from_top, factors.end())};
}

class Paths {
 public:
  // Follows a path with two limit points by either stepping, and compares with the reference.
  void add(const std::string& name, const PathScene& scene, ArcLengthSettings settings, double upper,
           double lower) {
    for (const Stepping stepping : {Stepping::arc_length, Stepping::current_stiffness}) {
      settings.stepping = stepping;
      const PathRun run = follow_path(scene, settings);
      const std::vector<double> limits = limit_load_factors(run.points);
      const auto against = [&](size_t i, double known) {
        if (i >= limits.size()) return std::string("not reached");
        return fmt::format("{:.5f} ({:+.2f} %)", limits[i], 100 * (limits[i] - known) / upper);
      };
      table_.add({name, stepping == Stepping::arc_length ? "arc length" : "current stiffness",
                  std::to_string(scene.model.num_nodes()), std::to_string(run.report.increments),
                  std::to_string(run.report.cutbacks), std::to_string(run.report.iterations),
                  against(0, upper), against(1, lower), std::to_string(num_misled(run)), end_of(run.report)});
    }
  }

  StudyTable& table() { return table_; }

 private:
  // Returns the number of increments where the current stiffness has another sign than the load's growth.
  static int num_misled(const PathRun& run) {
    int misled = 0;
    for (size_t i = 1; i < run.points.size(); ++i) {
      const bool grows = run.points[i].load_factor > run.points[i - 1].load_factor;
      const bool stiff = run.points[i].current_stiffness > 0 && run.points[i - 1].current_stiffness > 0;
      const bool soft = run.points[i].current_stiffness < 0 && run.points[i - 1].current_stiffness < 0;
      misled += (stiff && !grows) || (soft && grows) ? 1 : 0;
    }
    return misled;
  }

  static std::string end_of(const SolveReport& report) {
    if (report.converged) return "reached";
    return fmt::format("{} at {:.4f}", report.stopped == StopCause::path_reversed ? "misled" : "stopped",
                       report.load_factor);
  }

  StudyTable table_{
      "limit_points",
      "Paths past two limit points of the load, C3D10, by the arc length and by the current "
      "stiffness (Bergan's procedure), with the same first and largest increment; load factors "
      "at the limits, in brackets their difference to what is known, over the larger; increments "
      "misled = between whose ends the sign of the current stiffness parameter is not the "
      "direction of the load.",
      {"case", "increments by", "nodes", "increments", "cutbacks", "iterations", "upper limit", "lower limit",
       "increments misled", "end of the path"}};
};

ArcLengthSettings to_displacement(int dof, double value, double first, double largest) {
  ArcLengthSettings settings;
  settings.first_increment = first;
  settings.largest_increment = largest;
  settings.end_displacement = {dof, value};
  return settings;
}

void add_trusses(Paths& paths) {
  constexpr double kForce = 1e-3;
  const test::Truss truss;
  const auto [upper, lower] = limits_of([&](double w) { return truss.force(w); }, 2 * truss.rise, kForce);
  PathScene scene = truss.scene();
  scene.load.force[scene.dof()] = -kForce;
  for (const double largest : {std::numeric_limits<double>::infinity(), 0.05}) {
    paths.add(
        "shallow truss against its closed form" + std::string(largest < 1 ? " in short increments" : ""),
        scene, to_displacement(scene.dof(), -2.3 * truss.rise, 0.05, largest), upper, lower);
  }
  const test::ColumnOnTruss column;
  int apex = 0;
  scene = column.scene(apex);
  scene.load.force[scene.dof()] = -kForce;
  paths.add("the same pushed through a soft column whose end comes back", scene,
            to_displacement(3 * apex + 2, -2.1 * truss.rise, 0.03, 0.1), upper, lower);
}

void add_arches(Paths& paths) {
  for (const double thickness : {0.5, 0.25}) {
    test::Arch arch;
    arch.thickness = thickness;
    const double rise = arch.radius * (1 - std::cos(arch.half_angle));
    const double unit = 1e-4 * std::pow(thickness, 3);
    test::ArchRod rod(arch);
    const auto [upper, lower] = limits_of([&](double w) { return rod.force(w); }, 1.3 * rise, unit);
    PathScene scene = arch.scene(static_cast<int>(20 / thickness));
    scene.load.force *= unit;
    paths.add(fmt::format("clamped arch {:.0f} times as high as thick against a rod", rise / thickness),
              scene, to_displacement(scene.dof(), -1.5 * rise, 0.1 * upper, 0.4 * upper), upper, lower);
  }
}

double lowest_stiffness(const PathRun& run) {
  return std::min_element(
             run.points.begin(), run.points.end(),
             [](const PathPoint& a, const PathPoint& b) { return a.current_stiffness < b.current_stiffness; })
      ->current_stiffness;
}

StudyTable strip_table() {
  constexpr double kEuler = std::numbers::pi * std::numbers::pi / 4;
  const test::Strip strip;
  const PathScene scene = strip.scene(2 * kEuler, 40);
  ArcLengthSettings settings;
  settings.first_increment = 0.05;
  settings.end_load_factor = 1;
  settings.max_increments = 1000;
  const PathRun run = follow_path(scene, settings);
  settings.stepping = Stepping::current_stiffness;
  const PathRun by_stiffness = follow_path(scene, settings);
  StudyTable table(
      "buckled_strip",
      fmt::format(
          "A strip of 20 x 1 x 0.2, 40 cells of C3D10 along, pressed back along itself to twice Euler's "
          "load in one path, a hundredth of the load across: its tip against the elastica. {} increments of "
          "arc length; {} by the current stiffness, which falls to {:.1e}, and the tip ends within {:.0e} of "
          "the length.",
          run.report.increments, by_stiffness.report.increments, lowest_stiffness(by_stiffness),
          (by_stiffness.states.back() - run.states.back()).segment<3>(3 * scene.node).norm() / strip.length),
      {"force over Euler's", "x/L found", "elastica", "w/L found", "elastica ", "negative pivots"});
  for (size_t i = 5; i < run.points.size(); i += 5) {
    const double force = 2 * kEuler * run.points[i].load_factor;
    const test::ElasticaTip exact = test::elastica({-force, strip.aside * force}, 0, std::numbers::pi);
    const Eigen::Vector3d tip = run.states[i].segment<3>(3 * scene.node) / strip.length;
    table.add({fmt::format("{:.4f}", force / kEuler), fmt::format("{:.5f}", 1 + tip.x()),
               fmt::format("{:.5f}", exact.x), fmt::format("{:.5f}", tip.z()), fmt::format("{:.5f}", exact.y),
               std::to_string(run.points[i].negative_pivots)});
  }
  return table;
}

StudyTable given_loads_table() {
  StudyTable table("given_loads",
                   "The truss at given loads (*STATIC): where the solve stops, and what it cost.",
                   {"load over the limit", "first increment", "stops at, over the limit", "increments",
                    "cutbacks", "iterations"});
  constexpr double kForce = 1e-3;
  const test::Truss truss;
  const double limit = limits_of([&](double w) { return truss.force(w); }, 2 * truss.rise, kForce).first;
  PathScene scene = truss.scene();
  const Assembly assembly(scene.model, scene.model.fixed_dofs());
  for (const double load : {0.99, 1.1, 2.0, 4.0}) {
    for (const double first : {1.0, 0.1}) {
      StaticSolver solver(assembly);
      SolverSettings settings;
      settings.first_increment = first;
      settings.keep_to_path = true;
      scene.load.force[scene.dof()] = -load * limit * kForce;
      Eigen::VectorXd u = Eigen::VectorXd::Zero(scene.model.num_dofs());
      const SolveReport report = solver.ramp(LoadCase::rest(scene.model), scene.load, u, settings);
      table.add({fmt::format("{:g}", load), fmt::format("{:g}", first),
                 report.converged ? "solved" : fmt::format("{:.5f}", load * report.load_factor),
                 std::to_string(report.increments), std::to_string(report.cutbacks),
                 std::to_string(report.iterations)});
    }
  }
  return table;
}

}  // namespace

std::vector<StudyTable> limit_points_page() {
  Paths paths;
  add_trusses(paths);
  add_arches(paths);
  return {paths.table(), strip_table(), given_loads_table()};
}

}  // namespace palpate::study
