// Page of the solver's limit and order of convergence, and their independence of units, origin and frame.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "bench/solver/validation.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "tests/support/beam_scenes.hpp"
#include "tests/support/elastica.hpp"
#include "tests/support/hard_scenes.hpp"
#include "tests/support/reciprocity.hpp"

namespace palpate::study {
namespace {

using test::Beam;
using test::SceneRun;
using test::SolverScene;

double percent_above(double value, double reference) {
  return 100 * (value / reference - 1);
}

struct BentBeam {
  double deflection;  // of the tip, over the length
  int iterations;
};

// Bends a beam by a dead force of `force` EI / L^2 across its tip.
BentBeam bent(SceneRunner& runner, const Beam& beam, double force) {
  const SolverScene scene =
      loaded_beam(beam, {0, 0, force * test::kSecondMoment / (beam.length * beam.length)});
  const SceneRun run = runner(scene);
  return {tip_state(beam, scene, run).centre.z() / beam.length, run.iterations};
}

StudyTable elastica_table(SceneRunner& runner) {
  StudyTable table(
      "elastica",
      "A cantilever of 20 x 1 x 1 under a dead force P across its tip, 20 x 2 x 2 cells: deflection w "
      "against Euler's elastica.",
      {"P L^2/EI", "w/L elastica", "w/L C3D10 nu=0", "difference %", "iterations", "w/L C3D10 nu=0.3",
       "difference %", "iterations", "w/L C3D4 nu=0", "difference %", "iterations"});
  for (const double force : {1.0, 2.0, 5.0, 10.0}) {
    const double exact = test::elastica_across(force).y;
    std::vector<std::string> row = {fmt::format("{:g}", force), fmt::format("{:.5f}", exact)};
    for (const auto& [poisson, ten_nodes] : {std::pair{0.0, true}, {0.3, true}, {0.0, false}}) {
      Beam beam;
      beam.ten_nodes = ten_nodes;
      beam.law = test::neo_hookean_of(1, poisson);
      const BentBeam result = bent(runner, beam, force);
      row.push_back(fmt::format("{:.5f}", result.deflection));
      row.push_back(fmt::format("{:+.2f}", percent_above(result.deflection, exact)));
      row.push_back(std::to_string(result.iterations));
    }
    table.add(row);
  }
  return table;
}

StudyTable slenderness_table(SceneRunner& runner) {
  StudyTable table(
      "slenderness",
      "The same at P L^2/EI = 10, C3D10, nu = 0: the difference to the elastica is that of a beam's theory "
      "(shear, stretch), of order (h/L)^2; one cell of C3D10 a thickness is within 0.03 % of four.",
      {"L/h", "cells along", "w/L", "difference %", "iterations"});
  const double exact = test::elastica_across(10).y;
  for (const auto& [length, cells] : {std::pair{10, 20}, {20, 10}, {20, 20}, {20, 40}, {20, 80}, {40, 40}}) {
    Beam beam;
    beam.length = length;
    beam.cells_along = cells;
    const BentBeam result = bent(runner, beam, 10);
    table.add({std::to_string(length), std::to_string(cells), fmt::format("{:.5f}", result.deflection),
               fmt::format("{:+.3f}", percent_above(result.deflection, exact)),
               std::to_string(result.iterations)});
  }
  return table;
}

Model unit_block() {
  test::BlockShape shape;
  shape.law = CompressibleNeoHookean{1, 4};
  return test::tetrahedral_block(shape);
}

StudyTable residual_table(SceneRunner& runner) {
  StudyTable table(
      "residuals",
      "Relative residual after each iteration: with a fresh factor each time its digits double; by default "
      "an old factor serves as long as it gains a factor of five.",
      {"iteration", "block pushed by 0.3 fresh", "block default", "brain pushed by 2 h fresh",
       "brain default"});
  const Model brain = read_inp(std::filesystem::path(PALPATE_SOURCE_DIR) / "models" / "brain" / "brain.inp");
  const SolverScene scenes[2] = {test::moved_top(unit_block(), {0.15, 0.05, -0.3}),
                                 test::pushed_patch(brain, brain.find_node(936), 2)};
  std::vector<std::vector<IterationRecord>> histories;
  for (const SolverScene& scene : scenes) {
    for (const double reuse : {0.0, SolverSettings().reuse_contraction}) {
      SolverSettings settings;
      settings.reuse_contraction = reuse;
      histories.push_back(runner(scene, settings).history);
    }
  }
  std::size_t longest = 0;
  for (const auto& history : histories) longest = std::max(longest, history.size());
  for (std::size_t i = 0; i < longest; ++i) {
    std::vector<std::string> row = {std::to_string(i + 1)};
    for (const auto& history : histories)
      row.push_back(i < history.size() ? fmt::format("{:.1e}", history[i].residual) : "");
    table.add(row);
  }
  return table;
}

// An observer of the block's push, with other units of length and modulus and with turned and moved axes.
struct Observer {
  std::string name;
  double length = 1;
  double modulus = 1;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
};

SolverScene as_seen_by(const Observer& observer) {
  SolverScene scene = test::moved_top(unit_block(), {0.15, 0.05, -0.3});
  const Eigen::Matrix3d change = observer.length * observer.turn;
  for (Eigen::Vector3d& position : scene.model.positions) position = change * position + observer.origin;
  for (int node = 0; node < scene.model.num_nodes(); ++node) {
    auto motion = scene.steps[0].displacement.segment<3>(3 * node);
    motion = (change * motion).eval();
  }
  auto& law = std::get<CompressibleNeoHookean>(scene.model.materials[0].law);
  law.mu *= observer.modulus;
  law.lambda *= observer.modulus;
  return scene;
}

StudyTable invariance_table(SceneRunner& runner) {
  StudyTable table(
      "invariance",
      "A unit block whose top moves by (0.15 0.05 -0.3), seen by others: the largest difference of "
      "displacements over the largest displacement, and of forces over the largest force.",
      {"observer", "displacement", "force", "iterations"});
  const SolverScene reference_scene = as_seen_by({"own"});
  const SceneRun reference = runner(reference_scene);
  // The block's coordinates are multiples of 2^-20; only other coordinates show rounding.
  const Observer observers[] = {
      {"micrometres (1e6; modulus 1e-12)", 1e6, 1e-12},
      {"kilometres (1e-3; modulus 1e6)", 1e-3, 1e6},
      {"turned by 109 degrees", 1, 1, Eigen::Vector3d::Zero(), test::rotation_about({3, -1, 2}, 1.9)},
      {"2^20 body lengths away (no coordinate is rounded)", 1, 1, {0x1.0p20, -0x1.0p20, 0x1.0p20}},
      {"1e6 body lengths away (coordinates rounded at 1e-10)", 0.7, 1, {1.1e6, -0.7e6, 0.9e6}}};
  for (const Observer& observer : observers) {
    const SceneRun run = runner(as_seen_by(observer));
    const auto difference = [&](const Eigen::VectorXd& observed, const Eigen::VectorXd& reference_values,
                                double unit) {
      const Eigen::Matrix3Xd expected =
          observer.turn * reference_values.reshaped(3, reference_scene.model.num_nodes());
      return (observed / unit - expected.reshaped()).cwiseAbs().maxCoeff() /
             reference_values.cwiseAbs().maxCoeff();
    };
    table.add({observer.name,
               fmt::format("{:.1e}", difference(run.displacement, reference.displacement, observer.length)),
               fmt::format("{:.1e}", difference(run.force, reference.force,
                                                observer.modulus * observer.length * observer.length)),
               std::to_string(run.iterations)});
  }
  const int a = test::nodes_on_plane(reference_scene.model, 0, 0.0)[5];
  const int b = test::nodes_on_plane(reference_scene.model, 0, 1.0)[9];
  const test::ReciprocalForces forces = test::reciprocal_forces(reference_scene, reference, a, b);
  table.add({"reciprocity of two nodes' forces about that state", "",
             fmt::format("{:.1e}", (forces.at_a_due_to_b - forces.at_b_due_to_a.transpose()).norm() /
                                       forces.at_a_due_to_b.norm()),
             ""});
  return table;
}

}  // namespace

std::vector<StudyTable> convergence_page(SceneRunner& run) {
  return {elastica_table(run), slenderness_table(run), residual_table(run), invariance_table(run)};
}

}  // namespace palpate::study
