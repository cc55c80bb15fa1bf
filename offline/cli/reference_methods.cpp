#include "offline/cli/reference_methods.hpp"

#include <stdexcept>

#include "offline/precompute/linear_dd.hpp"

namespace palpate {

BackSolver::BackSolver(const Organ& organ) : organ_(&organ), solver_(organ.assembly) {
  factor_at_rest(solver_, organ.rest);
}

const BackSolver::Patch& BackSolver::patch_of(size_t site) {
  const auto found = patches_.find(site);
  if (found != patches_.end()) return found->second;
  const TiedPatch tied(solver_, organ_->sites.sites[site]);
  const Eigen::MatrixXd moved = tied.per_force() * tied.stiffness();
  Patch patch{organ_->assembly.tangent_times(organ_->rest.displacement_of(organ_->model), moved),
              tied.stiffness()};
  return patches_.emplace(site, std::move(patch)).first->second;
}

MethodAnswer BackSolver::answer(const std::vector<LinearContact>& contacts) {
  const auto& [site, displacement] = contacts.front();
  const Patch& patch = patch_of(site);
  Eigen::MatrixXd column = patch.loads * displacement;
  solve_at_rest(solver_, column);
  MethodAnswer answer;
  answer.field = packed_rows(organ_->sites, column);
  answer.forces = {patch.stiffness * displacement};
  return answer;
}

NewtonFrames::NewtonFrames(const Organ& organ, size_t site)
    : organ_(&organ),
      site_(site),
      solver_(organ.assembly),
      load_(held_patches(organ.model, organ.sites, organ.rest, {{site, Eigen::Vector3d::Zero()}})),
      u_(organ.rest.displacement_of(organ.model)) {}

void NewtonFrames::frame(const Eigen::Vector3d& displacement) {
  const LoadCase next = held_patches(organ_->model, organ_->sites, organ_->rest, {{site_, displacement}});
  Eigen::VectorXd guess = u_;
  for (const int node : organ_->sites.sites[site_].patch_nodes)
    guess.segment<3>(3 * node) = next.displacement.segment<3>(3 * node);
  if (solver_.correct(next, guess, SolverSettings()).converged) {
    u_ = guess;
  } else if (!solver_.ramp(load_, next, u_, SolverSettings()).converged) {
    throw std::runtime_error("Newton's method finds no equilibrium on the path of its frames");
  }
  load_ = next;
}

}  // namespace palpate
