// How far linear tetrahedra lock as the tissue becomes incompressible, and that quadratic ones do not.
#include <fmt/core.h>

#include <array>
#include <functional>

#include "bench/solver/validation.hpp"
#include "tests/support/locking_scenes.hpp"

namespace palpate::study {
namespace {

using test::SceneRun;
using test::SolverScene;

constexpr std::array<double, 6> kPoissonRatios = {0.3, 0.4, 0.45, 0.49, 0.499, 0.4999};

// One row a Poisson's ratio: `value` on three meshes of each element, each mesh of C3D10 with the nodes of
// that of C3D4.
StudyTable locking_table(const std::string& name, const std::string& caption, int coarsest,
                         const std::function<double(int cells, bool ten_nodes, double poisson)>& value) {
  std::vector<std::string> header = {"nu"};
  for (const int cells : {2 * coarsest, 4 * coarsest, 8 * coarsest})
    header.push_back(fmt::format("C3D4 {}", cells));
  for (const int cells : {coarsest, 2 * coarsest, 4 * coarsest})
    header.push_back(fmt::format("C3D10 {}", cells));
  header.push_back("finest C3D4 over finest C3D10");
  StudyTable table(name, caption, header);
  for (const double poisson : kPoissonRatios) {
    std::vector<std::string> row = {fmt::format("{:g}", poisson)};
    double finest[2] = {};
    for (const bool ten_nodes : {false, true}) {
      for (const int refinement : {1, 2, 4}) {
        finest[ten_nodes] = value((ten_nodes ? 1 : 2) * refinement * coarsest, ten_nodes, poisson);
        row.push_back(fmt::format("{:.4f}", finest[ten_nodes]));
      }
    }
    row.push_back(fmt::format("{:.3f}", finest[0] / finest[1]));
    table.add(row);
  }
  return table;
}

StudyTable small_strain_table(SceneRunner& run) {
  StudyTable table(
      "cook_small_strain",
      "Cook's membrane at small strain, E = 70, nu = 1/3, force 100, plane strain: rise of the upper corner; "
      "CalculiX, Code_Aster and Elmer have 32.20 to 32.28 on fine meshes (CoFEA's benchmark).",
      {"cells a side", "C3D4", "C3D10"});
  const double mu = 70 / (2 * (1 + 1.0 / 3));
  for (const int cells : {8, 16, 32}) {
    std::vector<std::string> row = {std::to_string(cells)};
    for (const bool ten_nodes : {false, true}) {
      const SolverScene scene = test::cooks_membrane(cells, ten_nodes, LinearElastic{mu, 2 * mu});
      row.push_back(fmt::format("{:.3f}", test::cooks_tip(scene, run(scene))));
    }
    table.add(row);
  }
  return table;
}

}  // namespace

std::vector<StudyTable> locking_page(SceneRunner& run) {
  const auto membrane = [&](int cells, bool ten_nodes, double poisson) {
    const SolverScene scene =
        test::cooks_membrane(cells, ten_nodes, test::neo_hooke_of(test::kCookShearModulus, poisson));
    return test::cooks_tip(scene, run(scene));
  };
  const auto block = [&](int cells, bool ten_nodes, double poisson) {
    const SolverScene scene = test::bonded_block(cells, ten_nodes, poisson);
    return test::plate_force(scene, run(scene));
  };
  return {
      small_strain_table(run),
      locking_table(
          "cook_locking",
          "Cook's membrane at finite strain, NEO HOOKE with mu = 80.1938, force 100, plane strain: rise of "
          "the upper corner by cells a side.",
          4, membrane),
      locking_table(
          "block_locking",
          "A unit block of NEO HOOKE with mu = 1 compressed by a tenth between plates that stick: force by "
          "cells a side.",
          2, block)};
}

}  // namespace palpate::study
