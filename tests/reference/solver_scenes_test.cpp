// Hard cases of the nonlinear solver, compared with beam theory, other programs and other paths.
// bench/solver/validation.cpp prints the figures from the same scenes.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "offline/mesh/inp_reader.hpp"
#include "tests/support/beam_scenes.hpp"
#include "tests/support/elastica.hpp"
#include "tests/support/hard_scenes.hpp"
#include "tests/support/locking_scenes.hpp"

namespace palpate {
namespace solver_scenes_test {

using test::Beam;
using test::ElasticaTip;
using test::Elements;
using test::SceneRun;
using test::SolverScene;
using test::TipState;

// Two solves to the default tolerance of 1e-10 stop at different points. Slow modes of a slender or deeply
// dented body magnify the difference.
constexpr double kSameAnswer = 1e-7;

// Every step converged with det F > 0, and free dofs bear the last step's load.
void expect_solved(const SolverScene& scene, const SceneRun& run) {
  ASSERT_TRUE(run.converged) << "stopped after " << run.steps_done << " of " << scene.steps.size()
                             << " steps";
  EXPECT_GT(run.min_jacobian, 0);
  const LoadCase& load = scene.steps.back();
  double unbalanced = 0;
  for (int dof = 0; dof < scene.model.num_dofs(); ++dof) {
    if (!load.held[static_cast<std::size_t>(dof)])
      unbalanced += std::pow(run.force[dof] - load.force[dof], 2);
  }
  EXPECT_LE(std::sqrt(unbalanced), SolverSettings().residual_tolerance * 2 * run.force.norm());
}

double stored_energy(const SolverScene& scene, const SceneRun& run) {
  const Assembly assembly(scene.model, scene.model.fixed_dofs());
  Eigen::VectorXd force;
  double energy = 0;
  assembly.internal_force(run.displacement, force, &energy);
  return energy;
}

// Deflection, shortening and tip angle of Mattiasson 1981, "Numerical results from large deflection beam and
// frame problems analysed by means of elliptic integrals", to the printed digits.
TEST(Elastica, IsThatOfTheEllipticIntegrals) {
  const double published[4][4] = {{1, 0.30172, 0.05643, 0.46135},
                                  {2, 0.49346, 0.16064, 0.78175},
                                  {5, 0.71379, 0.38763, 1.21537},
                                  {10, 0.81061, 0.55500, 1.43029}};
  for (const auto& [force, deflection, shortening, angle] : published) {
    const ElasticaTip tip = test::elastica_across(force);
    EXPECT_NEAR(tip.y, deflection, 5.1e-6);
    EXPECT_NEAR(1 - tip.x, shortening, 5.1e-6);
    EXPECT_NEAR(tip.angle, angle, 5.1e-6);
  }
  // Buckled with the tip at angle a: sqrt(P L^2 / EI) = K(sin(a/2)), K of modulus k.
  const double force = 5.5;
  const ElasticaTip tip = test::elastica_buckled(force, 0.0);
  EXPECT_NEAR(std::comp_ellint_1(std::sin(0.5 * tip.angle)), std::sqrt(force), 1e-9);
}

// A beam of 20 x 1 x 1 has shear, stretch and a solid clamp, the elastica has none. The difference falls with
// the square of the length.
TEST(SolverScenes, ACantileverIsTheElastica) {
  for (const double poisson : {0.0, 0.3}) {
    for (const double force : {1.0, 2.0, 5.0, 10.0}) {
      Beam beam;
      beam.law = test::neo_hookean_of(1, poisson);
      const SolverScene scene =
          loaded_beam(beam, {0, 0, force * test::kSecondMoment / (beam.length * beam.length)});
      const SceneRun run = run_scene(scene);
      expect_solved(scene, run);
      const TipState tip = tip_state(beam, scene, run);
      const ElasticaTip expected = test::elastica_across(force);
      EXPECT_NEAR(tip.centre.z() / beam.length, expected.y, 0.006 * expected.y) << poisson << " " << force;
      EXPECT_NEAR(tip.centre.x() / beam.length, expected.x, 0.003) << poisson << " " << force;
      EXPECT_NEAR(tip.angle, expected.angle, 0.003) << poisson << " " << force;
    }
  }
}

TEST(SolverScenes, ACantileversDifferenceToTheElasticaFallsWithItsSlenderness) {
  constexpr double kForce = 10;
  const auto difference = [](double length) {
    Beam beam;
    beam.length = length;
    beam.cells_along = static_cast<int>(2 * length);
    const SolverScene scene = loaded_beam(beam, {0, 0, kForce * test::kSecondMoment / (length * length)});
    const SceneRun run = run_scene(scene);
    expect_solved(scene, run);
    return tip_state(beam, scene, run).centre.z() / length - test::elastica_across(kForce).y;
  };
  EXPECT_NEAR(difference(10) / difference(20), 4, 0.2);
}

// Twice Euler's load along the beam, in a ramp from the straight form. The tangent is indefinite on the way,
// and the tip turns past 90 degrees.
TEST(SolverScenes, ABuckledCantileverIsTheElastica) {
  const Beam beam;
  const double force = 2 * std::numbers::pi * std::numbers::pi / 4;
  const double unit = test::kSecondMoment / (beam.length * beam.length);
  const SolverScene scene = loaded_beam(beam, force * unit * Eigen::Vector3d(-1, 0, 0.01));
  const SceneRun run = run_scene(scene);
  expect_solved(scene, run);
  EXPECT_GT(run.projected, 0);
  const TipState tip = tip_state(beam, scene, run);
  const ElasticaTip expected = test::elastica_buckled(force, 0.01);
  EXPECT_GT(tip.angle, std::numbers::pi / 2);
  EXPECT_NEAR(tip.angle, expected.angle, 0.01);
  EXPECT_NEAR(tip.centre.x() / beam.length, expected.x, 0.005);
  EXPECT_NEAR(tip.centre.z() / beam.length, expected.y, 0.001);
}

// The moment's error is of the square of the outer strain, a / 2 L = 0.06.
TEST(SolverScenes, ABeamBentTo135DegreesBearsTheMomentOfItsCurvature) {
  constexpr double kAngle = 0.75 * std::numbers::pi;
  const Beam beam;
  const SolverScene scene = bent_to_an_arc(beam, kAngle, 6);
  const SceneRun run = run_scene(scene);
  expect_solved(scene, run);
  EXPECT_LE(run.iterations, 80);
  EXPECT_GT(run.min_jacobian, 0.94) << "the inside is compressed to 0.94";
  const TipState tip = tip_state(beam, scene, run);
  EXPECT_NEAR(tip.angle, kAngle, 1e-9);
  const double moment = test::kSecondMoment * kAngle / beam.length;
  EXPECT_NEAR(-tip.moment.y(), moment, 0.002 * moment);
  EXPECT_LE(test::sum_over(run.force, beam.tip(scene.model)).norm(), 1e-6) << "of E times the section";
}

TEST(SolverScenes, ABarTwistedThrough180DegreesBearsTheSlopeOfItsEnergy) {
  for (const bool ten_nodes : {false, true}) {
    Beam beam;
    beam.length = 4;
    beam.cells_along = 8;
    beam.ten_nodes = ten_nodes;
    beam.law = CompressibleNeoHookean{1, 4};
    const SolverScene scene = twisted_beam(beam, std::numbers::pi, 8);
    const SceneRun run = run_scene(scene);
    expect_solved(scene, run);
    EXPECT_GT(run.min_jacobian, ten_nodes ? 0.93 : 0.85);

    const SolverScene in_fours = twisted_beam(beam, std::numbers::pi, 4);
    const SceneRun other = run_scene(in_fours);
    expect_solved(in_fours, other);
    EXPECT_LE((run.displacement - other.displacement).norm(), kSameAnswer * run.displacement.norm());

    // Central difference over 0.02 rad of 3.14: an error of the ratio's square.
    const auto energy_at = [&](double angle) {
      const SolverScene turned = twisted_beam(beam, angle, 8);
      return stored_energy(turned, run_scene(turned));
    };
    const double slope = (energy_at(std::numbers::pi + 0.01) - energy_at(std::numbers::pi - 0.01)) / 0.02;
    EXPECT_NEAR(tip_state(beam, scene, run).moment.x(), slope, 1e-4 * slope);
  }
}

// An inclusion ten thousand times stiffer moves rigidly to a ten-thousandth of the tissue's motion.
TEST(SolverScenes, AStiffInclusionIsCarriedAlong) {
  const auto distortion = [](double ratio, int most_iterations) {
    const SolverScene scene = test::moved_top(test::block_with_inclusion(ratio), {0.15, 0.05, -0.2});
    const SceneRun run = run_scene(scene);
    expect_solved(scene, run);
    EXPECT_LE(run.iterations, most_iterations);
    return test::distance_from_rigid(scene.model, 1, run.displacement);
  };
  EXPECT_NEAR(distortion(1e4, 25) / distortion(1e5, 200), 10, 0.05) << "far stiffer, as 1 over the stiffness";
  EXPECT_LE(distortion(1e4, 25), 1e-3 * distortion(1, 10));
}

TEST(SolverScenes, SliversAreSolvedLikeOtherElements) {
  SolverScene scene = test::moved_top(test::block_with_slivers(0.01), {0.15, 0.05, -0.2});
  ASSERT_LT(test::smallest_dihedral_angle(scene.model), 1.0);
  const SceneRun run = run_scene(scene);
  expect_solved(scene, run);
  EXPECT_EQ(run.cutbacks, 0);
  EXPECT_LE(run.iterations, 12);

  // Patch test: gradients a hundred times larger lose at most two of the solver's ten digits.
  Eigen::Matrix3d F;
  F << 1.2, 0.3, -0.1, 0.05, 0.85, 0.2, 0.1, -0.15, 0.95;
  const Eigen::VectorXd expected = test::affine_displacement(scene.model, F);
  scene.model.fixed.clear();
  LoadCase load = LoadCase::rest(scene.model);
  for (const int node : extract_surface(scene.model).nodes)
    test::hold_nodes(load, {node}, expected.segment<3>(3 * node));
  scene.steps = {load};
  const SceneRun patch = run_scene(scene);
  expect_solved(scene, patch);
  EXPECT_LE((patch.displacement - expected).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(SolverScenes, ABrainsPatchIsPushedToFourEdges) {
  const Model brain = read_inp(std::filesystem::path(PALPATE_SOURCE_DIR) / "models" / "brain" / "brain.inp");
  const int site = brain.find_node(936);
  struct Depth {
    double edges;
    int most_iterations;
    int most_cutbacks;
    double min_jacobian;
  };
  Eigen::VectorXd deepest;
  for (const Depth& depth :
       {Depth{1, 9, 0, 0.65}, Depth{2, 9, 0, 0.28}, Depth{3, 38, 2, 0.09}, Depth{4, 40, 3, 0.05}}) {
    SCOPED_TRACE(depth.edges);
    const SolverScene scene = test::pushed_patch(brain, site, depth.edges);
    const SceneRun run = run_scene(scene);
    expect_solved(scene, run);
    EXPECT_LE(run.iterations, depth.most_iterations);
    EXPECT_LE(run.cutbacks, depth.most_cutbacks);
    EXPECT_GT(run.min_jacobian, depth.min_jacobian);
    deepest = run.displacement;
  }
  // Steps of half an edge stay on the branch from rest and reach the same state.
  SolverScene slowly{brain, {}};
  for (int half = 1; half <= 8; ++half)
    slowly.steps.push_back(test::pushed_patch(brain, site, 0.5 * half).steps.front());
  const SceneRun run = run_scene(slowly);
  expect_solved(slowly, run);
  EXPECT_LE((run.displacement - deepest).norm(), kSameAnswer * deepest.norm());
}

// Small-strain Cook's membrane, E = 70, nu = 1/3. Its corner rises by 32.20 to 32.28 with CalculiX,
// Code_Aster and Elmer on fine meshes (CoFEA's benchmark, quoted by solids4foam's tutorial cooksMembrane).
TEST(SolverScenes, CooksMembraneIsThatOfOtherPrograms) {
  const double mu = 70 / (2 * (1 + 1.0 / 3));
  double tips[3];
  for (int i = 0; i < 3; ++i) {
    const SolverScene scene = test::cooks_membrane(8 << i, test::Elements::c3d10, LinearElastic{mu, 2 * mu});
    const SceneRun run = run_scene(scene);
    expect_solved(scene, run);
    tips[i] = test::cooks_tip(scene, run);
  }
  EXPECT_NEAR(tips[2], 32.24, 0.1);
  // Aitken's limit of three meshes.
  const double ratio = (tips[2] - tips[1]) / (tips[1] - tips[0]);
  EXPECT_NEAR(tips[2] + (tips[2] - tips[1]) * ratio / (1 - ratio), 32.27, 0.03);
}

// At equal numbers of nodes: both elements agree at low Poisson's ratios, and four-node elements lock near
// 0.5.
TEST(SolverScenes, TenNodesDoNotLockWhereFourDo) {
  const auto tip = [](int cells, Elements elements, double poisson) {
    const SolverScene scene =
        test::cooks_membrane(cells, elements, test::neo_hooke_of(test::kCookShearModulus, poisson));
    const SceneRun run = run_scene(scene);
    expect_solved(scene, run);
    return test::cooks_tip(scene, run);
  };
  for (const double poisson : {0.3, 0.499}) {
    const double fine = tip(16, Elements::c3d10, poisson);
    EXPECT_NEAR(tip(8, Elements::c3d10, poisson), fine, 0.04 * fine);
    if (poisson < 0.4) {
      EXPECT_NEAR(tip(32, Elements::c3d4, poisson), fine, 0.04 * fine);
    } else {
      EXPECT_LE(tip(32, Elements::c3d4, poisson), 0.5 * fine);
    }
  }
  const auto force = [](int cells, Elements elements, double poisson) {
    const SolverScene scene = test::bonded_block(cells, elements, poisson);
    const SceneRun run = run_scene(scene);
    expect_solved(scene, run);
    return test::plate_force(scene, run);
  };
  EXPECT_NEAR(force(8, Elements::c3d4, 0.3), force(4, Elements::c3d10, 0.3),
              0.015 * force(4, Elements::c3d10, 0.3));
  EXPECT_GE(force(8, Elements::c3d4, 0.499), 2.5 * force(4, Elements::c3d10, 0.499));
  EXPECT_NEAR(force(4, Elements::c3d10, 0.499), force(8, Elements::c3d10, 0.499),
              0.06 * force(8, Elements::c3d10, 0.499));
}

// The middle meshes of the locking tables in docs/solver_validation.md, against the limits of C3D10H's three
// meshes.
TEST(SolverScenes, SharedVolumesDoNotLock) {
  constexpr double kPoisson = 0.499;
  constexpr double kRise = 6.92;
  constexpr double kForce = 0.4093;
  constexpr double kForceOfCylinder = 0.3125;
  constexpr double kStiffness = 0.854;
  const Law rubber = test::neo_hooke_of(test::kCookShearModulus, kPoisson);
  const auto solved = [](const SolverScene& scene, double (*value)(const SolverScene&, const SceneRun&)) {
    const SceneRun run = run_scene(scene);
    expect_solved(scene, run);
    return value(scene, run);
  };
  for (const auto& [elements, refinement] :
       {std::pair(Elements::c3d4_mean_dilatation, 2), std::pair(Elements::c3d10h, 1)}) {
    EXPECT_NEAR(solved(test::cooks_membrane(16 * refinement, elements, rubber), test::cooks_tip), kRise,
                0.03 * kRise);
    EXPECT_NEAR(solved(test::bonded_block(4 * refinement, elements, kPoisson, true), test::plate_force),
                kForce, 0.03 * kForce);
    EXPECT_NEAR(solved(test::bonded_cylinder(4 * refinement, elements, kPoisson), test::plate_force),
                kForceOfCylinder, 0.03 * kForceOfCylinder);
    EXPECT_NEAR(solved(test::indented_block(4 * refinement, elements, kPoisson), test::indentation_stiffness),
                kStiffness, 0.03 * kStiffness);
  }
  // Without locking, shared volumes change little.
  const double apart = solved(test::bonded_block(8, Elements::c3d4, 0.3, true), test::plate_force);
  EXPECT_NEAR(solved(test::bonded_block(8, Elements::c3d4_mean_dilatation, 0.3, true), test::plate_force),
              apart, 0.01 * apart);
}
}  // namespace solver_scenes_test
}  // namespace palpate
