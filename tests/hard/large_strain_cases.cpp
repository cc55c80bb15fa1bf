// Strains of 30 to 60 %: homogeneous states against closed forms, pushed patches against full solves and
// other paths.
#include <fmt/core.h>

#include <Eigen/LU>

#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"
#include "tests/support/principal_stretch_laws.hpp"

namespace palpate::hard {
namespace {

// The boundary of a unit block moves by x = F X, the inside is free. Exact: u = (F - 1) X, and sum of f X^T
// over the surface = stress times volume.
std::vector<Answer> homogeneous(const Law& law, const Eigen::Matrix3d& F, const Eigen::Matrix3d& stress) {
  test::SolverScene scene{unit_block(4, law), {}};
  scene.model.fixed.clear();
  LoadCase load = LoadCase::rest(scene.model);
  const Eigen::VectorXd expected = test::affine_displacement(scene.model, F);
  for (const int node : extract_surface(scene.model).nodes) {
    for (int axis = 0; axis < 3; ++axis) load.held[static_cast<size_t>(3 * node + axis)] = 1;
    load.displacement.segment<3>(3 * node) = expected.segment<3>(3 * node);
  }
  scene.steps = {load};
  const test::SceneRun run = test::run_scene(scene);
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (int node = 0; node < scene.model.num_nodes(); ++node)
    moment += run.force.segment<3>(3 * node) * scene.model.positions[static_cast<size_t>(node)].transpose();
  return {solved(run, expected, 1.0, moment.col(2), stress.col(2))};
}

// Stretches along the axes, with the law's principal stresses as reference.
std::vector<Answer> stretched(const test::PrincipalStretchLaw& law, const Eigen::Vector3d& stretches) {
  return homogeneous(law.law, stretches.asDiagonal(), law.stresses(stretches).asDiagonal());
}

// P = mu (F - F^-T) + lambda J (J - 1) F^-T, Zhong et al. 2005 eq. (1).
std::vector<Answer> sheared(double strain) {
  Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
  F(0, 2) = strain;
  const Eigen::Matrix3d inverse_transposed = F.inverse().transpose();
  return homogeneous(kTissue, F, kTissue.mu * (F - inverse_transposed));  // J = 1
}

std::vector<Answer> patch_solved(double depth, bool aside) {
  test::SolverScene scene{unit_block(6), {}};
  LoadCase load = LoadCase::rest(scene.model);
  const Surface surface = extract_surface(scene.model);
  int middle = 0;
  for (const int node : inner_top(scene.model)) {
    const auto from_middle = [&](int of) {
      return (scene.model.positions[static_cast<size_t>(of)] - Eigen::Vector3d(0.5, 0.5, 1)).norm();
    };
    if (middle == 0 || from_middle(node) < from_middle(middle)) middle = node;
  }
  const std::vector<int> patch = nodes_within(surface, middle, 1.1 / 6);
  test::hold_nodes(load, patch, depth * (aside ? Eigen::Vector3d(0.8, 0, -0.6) : Eigen::Vector3d(0, 0, -1)));
  scene.steps = {load};
  return {solved_on_two_paths(scene, patch, depth)};
}

std::vector<Answer> pack_at(double strain, bool polynomial, const Bar& bar) {
  const Organ& organ = shared_organ(fmt::format("strain {} {}", strain, polynomial), [&] {
    OrganSpec spec = touched(unit_block(4), strain, 0.26);
    spec.polynomial = polynomial;
    spec.sites.resize(5);
    spec.zone_rings = 2;
    return spec;
  });
  return pushed_four_ways(organ, organ.site_near({0.5, 0.5, 1}), strain, bar);
}

}  // namespace

Group large_strain_cases() {
  Group group{"strain",
              "Strains of 30 to 60 %",
              "A block of unit thickness: homogeneous strains beside each law's closed form, a patch "
              "pushed in beside the "
              "same push in sixteen increments, and packs whose sites may be pushed as far, into the block, "
              "out of it and "
              "aside, beside full solves. A domain that the solver cannot reach is cut, and what lies beyond "
              "it is flagged.",
              {}};
  const auto add = [&](const std::string& name, const std::string& hard, const Bar& bar, auto run) {
    group.cases.push_back({"strain", name, hard, bar, Expected::answer, "", run});
  };
  const Bar closed_form = {1e-8, 1e-8};
  for (const test::PrincipalStretchLaw& law : test::principal_stretch_laws()) {
    add("compressed_60_" + law.name, "block compressed by 60 %, homogeneously, " + law.name, closed_form,
        [law] {
          return stretched(law, {1.1, 1.1, 0.4});
        });
    add("stretched_60_" + law.name, "block stretched by 60 %, homogeneously, " + law.name, closed_form,
        [law] {
          return stretched(law, {0.9, 0.9, 1.6});
        });
  }
  for (const double strain : {0.3, 0.6}) {
    const int percent = static_cast<int>(100 * strain + 0.5);
    add(fmt::format("sheared_{}", percent), fmt::format("block sheared by {} %, homogeneously", percent),
        closed_form, [strain] { return sheared(strain); });
  }
  const Bar other_path = {1e-6, 1e-6};
  for (const double depth : {0.3, 0.45, 0.6}) {
    const int percent = static_cast<int>(100 * depth + 0.5);
    add(fmt::format("patch_in_{}", percent),
        fmt::format("patch of one edge pushed in by {} % of the thickness, {:.1f} edges", percent, 6 * depth),
        other_path, [depth] { return patch_solved(depth, false); });
  }
  add("patch_aside_45", "patch of one edge dragged in and aside by 45 % of the thickness", other_path,
      [] { return patch_solved(0.45, true); });
  const Bar bar = {0.02, 0.02};
  for (const double strain : {0.3, 0.45, 0.6}) {
    const int percent = static_cast<int>(100 * strain + 0.5);
    add(fmt::format("pack_{}", percent),
        fmt::format("pack whose sites are pushed four ways by {} % of the thickness", percent), bar,
        [strain, bar] { return pack_at(strain, true, bar); });
    group.cases.back().slow = strain > 0.5;
  }
  add("zone_pack_30", "pack of zones of two rings, pushed four ways by 30 % of the thickness, 1.2 edges", bar,
      [bar] { return pack_at(0.3, false, bar); });
  group.cases.push_back({"strain", "zone_pack_45",
                         "pack of zones of two rings, pushed four ways by 45 % of the thickness, 1.8 edges",
                         bar, Expected::answer, "", [bar] { return pack_at(0.45, false, bar); }});
  return group;
}

}  // namespace palpate::hard
