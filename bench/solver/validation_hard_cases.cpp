// Page of the cost and the result of each hard case of the solver.
#include <fmt/core.h>

#include <filesystem>
#include <numbers>

#include "bench/solver/validation.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "tests/support/beam_scenes.hpp"
#include "tests/support/elastica.hpp"
#include "tests/support/hard_scenes.hpp"

namespace palpate::study {
namespace {

using test::Beam;
using test::SceneRun;
using test::SolverScene;
using test::TipState;

constexpr double kDegrees = 180 / std::numbers::pi;

class HardCases {
 public:
  explicit HardCases(SceneRunner& runner) : runner_(&runner) {}

  SceneRun add(const std::string& name, const SolverScene& scene, const std::string& outcome = "") {
    SceneRun run = (*runner_)(scene);
    table_.add({name, std::to_string(scene.model.num_nodes()),
                run.converged ? std::to_string(scene.steps.size())
                              : fmt::format("{:.2f} of {}", run.steps_done, scene.steps.size()),
                std::to_string(run.increments), std::to_string(run.cutbacks), std::to_string(run.iterations),
                std::to_string(run.factorizations), std::to_string(run.projected),
                fmt::format("{:.3f}", run.min_jacobian), outcome});
    return run;
  }

  StudyTable& table() { return table_; }

 private:
  SceneRunner* runner_;
  StudyTable table_{
      "hard_cases",
      "Hard cases with the default settings; projected = iterations that took the positive semi-definite "
      "tangent, min J = the smallest det F at the end of a step.",
      {"case", "nodes", "ramps", "increments", "cutbacks", "iterations", "factorizations", "projected",
       "min J", "mesh"}};
};

// Collects the rows that beam theory predicts.
class BeamOutcomes {
 public:
  void add(const std::string& name, const std::string& quantity, double found, double theory) {
    table_.add({name, quantity, fmt::format("{:.5g}", found), fmt::format("{:.5g}", theory),
                fmt::format("{:+.2f}", 100 * (found / theory - 1))});
  }
  StudyTable& table() { return table_; }

 private:
  StudyTable table_{"large_rotations",
                    "Large rotations of a beam of 20 x 1 x 1, C3D10, against beam theory.",
                    {"case", "quantity", "found", "theory", "difference %"}};
};

void add_beams(HardCases& cases, BeamOutcomes& outcomes) {
  const Beam beam;
  const double unit = test::kSecondMoment / (beam.length * beam.length);
  const double euler = std::numbers::pi * std::numbers::pi / 4;
  for (const double factor : {1.2, 2.0, 3.0}) {
    const double force = factor * euler;
    const SolverScene scene = loaded_beam(beam, force * unit * Eigen::Vector3d(-1, 0, 0.01));
    const std::string name = fmt::format("beam buckled by {:g} of Euler's load", factor);
    const TipState tip = tip_state(beam, scene, cases.add(name, scene, "C3D10"));
    const test::ElasticaTip exact = test::elastica_buckled(force, 0.01);
    outcomes.add(name, "tip angle in degrees", tip.angle * kDegrees, exact.angle * kDegrees);
    outcomes.add(name, "tip w/L", tip.centre.z() / beam.length, exact.y);
  }
  constexpr double kArc = 0.75 * std::numbers::pi;
  const SolverScene arc = bent_to_an_arc(beam, kArc, 6);
  const std::string name = "beam bent to an arc of 135 degrees";
  const TipState tip = tip_state(beam, arc, cases.add(name, arc, "C3D10"));
  outcomes.add(name, "moment over E h^3", -tip.moment.y(), test::kSecondMoment * kArc / beam.length);
}

void add_twists(HardCases& cases) {
  for (const bool ten_nodes : {true, false}) {
    for (const int steps : {8, 4}) {
      Beam bar;
      bar.length = 4;
      bar.cells_along = 8;
      bar.ten_nodes = ten_nodes;
      bar.law = CompressibleNeoHookean{1, 4};
      cases.add("bar of 4 x 1 x 1 twisted by 180 degrees", twisted_beam(bar, std::numbers::pi, steps),
                ten_nodes ? "C3D10" : "C3D4");
    }
  }
}

void add_blocks(HardCases& cases) {
  const Eigen::Vector3d motion(0.15, 0.05, -0.2);
  for (const double ratio : {1.0, 1e4, 1e6})
    cases.add(fmt::format("block with an inclusion {:g} times stiffer", ratio),
              test::moved_top(test::block_with_inclusion(ratio), motion), "C3D4");
  for (const double flatness : {1.0, 0.1, 0.01, 0.001}) {
    const SolverScene scene = test::moved_top(test::block_with_slivers(flatness), motion);
    cases.add(fmt::format("block with dihedral angles from {:.2g} degrees",
                          test::smallest_dihedral_angle(scene.model)),
              scene, "C3D4");
  }
}

void add_brain(HardCases& cases) {
  const Model brain = read_inp(std::filesystem::path(PALPATE_SOURCE_DIR) / "models" / "brain" / "brain.inp");
  const int site = brain.find_node(936);
  for (const double depth : {1.0, 2.0, 3.0, 4.0, 5.0})
    cases.add(fmt::format("patch of the brain pushed in by {:g} h", depth),
              test::pushed_patch(brain, site, depth), "C3D4");
}

}  // namespace

std::vector<StudyTable> hard_cases_page(SceneRunner& run) {
  HardCases cases(run);
  BeamOutcomes outcomes;
  add_beams(cases, outcomes);
  add_twists(cases);
  add_blocks(cases);
  add_brain(cases);
  return {cases.table(), outcomes.table()};
}

}  // namespace palpate::study
