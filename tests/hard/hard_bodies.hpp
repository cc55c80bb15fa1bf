// Bodies that several cases share.
#pragma once

#include <algorithm>
#include <vector>

#include "tests/hard/hard_organ.hpp"
#include "tests/support/hard_scenes.hpp"
#include "tests/support/locking_scenes.hpp"

namespace palpate::hard {

inline const CompressibleNeoHookean kTissue = {1, 4};  // nu = 0.4

// The nodes on the top of a unit block, without the top's edges.
inline std::vector<int> inner_top(const Model& model) {
  std::vector<int> nodes;
  for (const int node : test::nodes_on_plane(model, 2, 1.0)) {
    const Eigen::Vector3d& at = model.positions[static_cast<size_t>(node)];
    if (at.x() > 1e-9 && at.x() < 1 - 1e-9 && at.y() > 1e-9 && at.y() < 1 - 1e-9) nodes.push_back(node);
  }
  return nodes;
}

inline Model unit_block(int cells, const Law& law = kTissue, double jitter = 0.15) {
  test::BlockShape shape;
  shape.cells = {cells, cells, cells};
  shape.law = law;
  shape.jitter = jitter;
  return test::with_fixed_base(test::tetrahedral_block(shape));
}

// The same with shared volumes.
inline Model nearly_incompressible_block(int cells, test::Elements elements, const Law& law) {
  Model block = unit_block(cells, law);
  block.fixed.clear();
  return test::with_fixed_base(test::share_volumes(elements, test::in_nodes_of(elements, std::move(block))));
}

// A unit block with sites at all inner nodes of its top.
inline OrganSpec touched(Model model, double max_displacement, double tip_radius) {
  OrganSpec spec;
  spec.model = std::move(model);
  spec.sites = inner_top(spec.model);
  spec.max_displacement = max_displacement;
  spec.tip_radius = tip_radius;
  return spec;
}

// Into the top of a block, out of it, sideways, and oblique.
inline std::vector<Eigen::Vector3d> four_ways(double size) {
  return {{0, 0, -size}, {0, 0, size}, {size, 0, 0}, size * Eigen::Vector3d(0.5, -0.4, -0.8).normalized()};
}

// A contact at a site, pushed four ways, for every response model: the worst answer of each.
inline std::vector<Answer> pushed_four_ways(const Organ& organ, std::uint32_t site, double size,
                                            const Bar& bar) {
  std::vector<std::vector<Answer>> sets;
  for (const Eigen::Vector3d& d : four_ways(size)) sets.push_back(ask_all(organ, {push(site, d)}));
  return worst_of(sets, bar);
}

// Errors of a solve: max |u - u'| / scale, and |f - f'| / |f'| over the held nodes.
inline Answer solved(const test::SceneRun& run, const Eigen::VectorXd& displacement, double scale,
                     const Eigen::Vector3d& force, const Eigen::Vector3d& expected_force) {
  Answer answer;
  answer.by = "solve";
  if (!run.converged) {
    answer.refused = true;
    answer.happened = "no equilibrium from load factor " + std::to_string(run.steps_done) + " on";
    return answer;
  }
  answer.happened = std::to_string(run.increments) + " increments, " + std::to_string(run.iterations) +
                    " iterations, smallest J " + std::to_string(run.min_jacobian).substr(0, 6);
  answer.finite = run.displacement.allFinite() && force.allFinite();
  answer.displacement_error = (run.displacement - displacement).lpNorm<Eigen::Infinity>() / scale;
  answer.force_error = (force - expected_force).norm() / expected_force.norm();
  return answer;
}

// The scene solved with default settings, compared with many small increments and a new factor in each
// iteration.
inline Answer solved_on_two_paths(const test::SolverScene& scene, const std::vector<int>& held, double scale,
                                  int increments = 16) {
  SolverSettings fine;
  fine.first_increment = fine.largest_increment = 1.0 / increments;
  fine.max_increments = 10000;
  fine.reuse_contraction = 0;
  fine.residual_tolerance = 1e-11;
  const test::SceneRun run = test::run_scene(scene);
  const test::SceneRun reference = test::run_scene(scene, fine);
  Answer answer = solved(run, reference.displacement, scale, test::sum_over(run.force, held),
                         test::sum_over(reference.force, held));
  if (!reference.converged && !answer.refused) {
    answer.displacement_error = answer.force_error = Answer::kNotMeasured;
    answer.flags = {"the reference does not converge"};
  }
  return answer;
}

}  // namespace palpate::hard
