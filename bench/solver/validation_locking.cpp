// Page of locking in nearly incompressible tissue: linear, shared-volume and quadratic elements.
#include <fmt/core.h>

#include <array>
#include <functional>
#include <utility>

#include "bench/solver/validation.hpp"
#include "tests/support/locking_scenes.hpp"

namespace palpate::study {
namespace {

using test::Elements;
using test::SceneRun;
using test::SolverScene;

constexpr std::array<double, 6> kPoissonRatios = {0.3, 0.4, 0.45, 0.49, 0.499, 0.4999};
constexpr std::array kEveryElement = {Elements::c3d4, Elements::c3d4_mean_dilatation, Elements::c3d10,
                                      Elements::c3d10h};

const char* name_of(Elements elements) {
  switch (elements) {
    case Elements::c3d4:
      return "C3D4";
    case Elements::c3d4_mean_dilatation:
      return "C3D4 MEAN DILATATION";
    case Elements::c3d10:
      return "C3D10";
    case Elements::c3d10h:
      return "C3D10H";
  }
  return "";
}

bool has_ten_nodes(Elements elements) {
  return elements == Elements::c3d10 || elements == Elements::c3d10h;
}

struct MeshResult {
  double value = 0;
  double seconds = 0;
  int nodes = 0;
};

using Case = std::function<MeshResult(int cells, Elements elements, double poisson)>;

// Solves a case on three meshes of each element; a ten-node mesh has the nodes of the four-node mesh. Adds a
// row for each Poisson's ratio and element. The converged value is Aitken's limit of C3D10H's three meshes.
std::pair<StudyTable, StudyTable> locking_tables(const std::string& name, const std::string& caption,
                                                 int coarsest, const Case& answer) {
  StudyTable errors(name, caption + " Error of each mesh in percent of the converged value.",
                    {"nu", "converged", "element", "coarse %", "middle %", "fine %"});
  StudyTable costs(name + "_cost",
                   "What that took at nu = 0.499, one thread: seconds of a whole solve, with nodes.",
                   {"element", "coarse", "middle", "fine"});
  for (const double poisson : kPoissonRatios) {
    std::array<std::array<MeshResult, 3>, kEveryElement.size()> answers;
    for (size_t kind = 0; kind < kEveryElement.size(); ++kind) {
      for (size_t mesh = 0; mesh < 3; ++mesh) {
        const int cells = (has_ten_nodes(kEveryElement[kind]) ? 1 : 2) * coarsest << mesh;
        answers[kind][mesh] = answer(cells, kEveryElement[kind], poisson);
      }
    }
    const auto& [coarse, middle, fine] = answers.back();
    const double ratio = (fine.value - middle.value) / (middle.value - coarse.value);
    const double limit = fine.value + (fine.value - middle.value) * ratio / (1 - ratio);
    for (size_t kind = 0; kind < kEveryElement.size(); ++kind) {
      std::vector<std::string> row = {fmt::format("{:g}", poisson), fmt::format("{:.4f}", limit),
                                      name_of(kEveryElement[kind])};
      std::vector<std::string> cost = {name_of(kEveryElement[kind])};
      for (const MeshResult& one : answers[kind]) {
        row.push_back(fmt::format("{:+.2f}", 100 * (one.value / limit - 1)));
        cost.push_back(fmt::format("{:.2f} s ({})", one.seconds, one.nodes));
      }
      errors.add(std::move(row));
      if (poisson == 0.499) costs.add(std::move(cost));
    }
  }
  return {std::move(errors), std::move(costs)};
}

StudyTable small_strain_table(SceneRunner& run) {
  StudyTable table(
      "cook_small_strain",
      "Cook's membrane at small strain, E = 70, nu = 1/3, force 100, plane strain: rise of the upper corner; "
      "CalculiX, Code_Aster and Elmer have 32.20 to 32.28 on fine meshes (CoFEA's benchmark).",
      {"cells a side", "C3D4", "C3D10", "C3D10H"});
  const double mu = 70 / (2 * (1 + 1.0 / 3));
  for (const int cells : {8, 16, 32}) {
    std::vector<std::string> row = {std::to_string(cells)};
    for (const Elements elements : {Elements::c3d4, Elements::c3d10, Elements::c3d10h}) {
      const SolverScene scene = test::cooks_membrane(cells, elements, LinearElastic{mu, 2 * mu});
      row.push_back(fmt::format("{:.3f}", test::cooks_tip(scene, run(scene))));
    }
    table.add(row);
  }
  return table;
}

// Compares numbers of elements in a volume patch, on the middle meshes at nu = 0.499.
StudyTable patch_size_table(SceneRunner& run) {
  StudyTable table(
      "patch_sizes",
      "The middle meshes of C3D4 MEAN DILATATION at nu = 0.499 by elements wanted to a patch; min J: the "
      "smallest det F of an element of the bonded block.",
      {"elements to a patch", "rise of the membrane", "force of the block", "min J",
       "stiffness of the indented block"});
  constexpr double kPoisson = 0.499;
  constexpr Elements kElements = Elements::c3d4_mean_dilatation;
  for (const int size : {2, 4, 6, 8, 12, 16, 24}) {
    const SolverScene membrane =
        test::cooks_membrane(32, kElements, test::neo_hooke_of(test::kCookShearModulus, kPoisson), size);
    const SolverScene block = test::bonded_block(8, kElements, kPoisson, true, size);
    const SolverScene indented = test::indented_block(8, kElements, kPoisson, size);
    const double rise = test::cooks_tip(membrane, run(membrane));
    const SceneRun pressed = run(block);
    table.add({std::to_string(size), fmt::format("{:.3f}", rise),
               fmt::format("{:.4f}", test::plate_force(block, pressed)),
               fmt::format("{:.3f}", pressed.min_jacobian),
               fmt::format("{:.4f}", test::indentation_stiffness(indented, run(indented)))});
  }
  return table;
}

}  // namespace

std::vector<StudyTable> locking_page(SceneRunner& run) {
  const auto solved = [&](const SolverScene& scene, double (*value)(const SolverScene&, const SceneRun&)) {
    const SceneRun answer = run(scene);
    return MeshResult{value(scene, answer), answer.seconds, scene.model.num_nodes()};
  };
  const auto membrane = [&](int cells, Elements elements, double poisson) {
    return solved(test::cooks_membrane(cells, elements, test::neo_hooke_of(test::kCookShearModulus, poisson)),
                  test::cooks_tip);
  };
  const auto block = [&](int cells, Elements elements, double poisson) {
    return solved(test::bonded_block(cells, elements, poisson, true), test::plate_force);
  };
  const auto cylinder = [&](int cells, Elements elements, double poisson) {
    return solved(test::bonded_cylinder(cells, elements, poisson), test::plate_force);
  };
  const auto indented = [&](int cells, Elements elements, double poisson) {
    return solved(test::indented_block(cells, elements, poisson), test::indentation_stiffness);
  };
  std::vector<StudyTable> page = {small_strain_table(run)};
  const auto add = [&](std::pair<StudyTable, StudyTable> tables) {
    page.push_back(std::move(tables.first));
    page.push_back(std::move(tables.second));
  };
  add(locking_tables(
      "cook_locking",
      "Cook's membrane at finite strain, NEO HOOKE with mu = 80.1938, force 100, plane strain, 16, 32 "
      "and 64 cells of four nodes a side or half as many of ten: rise of the upper corner.",
      8, membrane));
  add(locking_tables(
      "block_locking",
      "A block of NEO HOOKE with mu = 1 between plates that stick, compressed by a tenth, an eighth of it "
      "with planes of symmetry, 4, 8 and 16 cells of four nodes a side or half as many of ten: force.",
      2, block));
  add(locking_tables("cylinder_locking",
                     "A cylinder of NEO HOOKE with mu = 1, as high as wide, between plates that stick, "
                     "compressed by a tenth, an "
                     "eighth of it with planes of symmetry, 4, 8 and 16 cells of four nodes a side or half "
                     "as many of ten, their "
                     "sides round: force.",
                     2, cylinder));
  add(locking_tables(
      "indentation_locking",
      "A block of NEO HOOKE with mu = 1 on a plate, a smooth tool that sticks and is as wide as the block "
      "is high pushes 0.1 of that deep, a quarter with planes of symmetry, 4, 8 and 16 cells of four "
      "nodes a side or half as many of ten: work over half the square of the depth.",
      2, indented));
  page.push_back(patch_size_table(run));
  return page;
}

}  // namespace palpate::study
