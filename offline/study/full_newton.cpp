#include "offline/study/full_newton.hpp"

#include <stdexcept>

#include "offline/fem/static_solver.hpp"
#include "offline/precompute/contact_truth.hpp"
#include "offline/study/method_timing.hpp"
#include "offline/study/timed_contacts.hpp"

namespace palpate {
namespace {

// Each frame moves the patches and iterates to convergence from the last frame's state, at first from rest.
class NewtonFrames {
 public:
  NewtonFrames(const Organ& organ, const std::vector<std::uint32_t>& sites)
      : organ_(organ),
        sites_(sites),
        solver_(organ.assembly),
        load_(load_for(Eigen::Vector3d::Zero())),
        u_(organ.rest.displacement_of(organ.model)) {}

  // Moves all contacts to `displacement` from rest. Ramps the load where Newton fails from the last state.
  void frame(const Eigen::Vector3d& displacement) {
    const LoadCase next = load_for(displacement);
    Eigen::VectorXd guess = u_;
    for (const std::uint32_t site : sites_) {
      for (const int node : organ_.sites.sites[site].patch_nodes)
        guess.segment<3>(3 * node) = next.displacement.segment<3>(3 * node);
    }
    if (solver_.correct(next, guess, SolverSettings()).converged) {
      u_ = guess;
    } else if (!solver_.ramp(load_, next, u_, SolverSettings()).converged) {
      throw std::runtime_error("Newton's method finds no equilibrium on the path of its frames");
    }
    load_ = next;
  }

 private:
  LoadCase load_for(const Eigen::Vector3d& displacement) const {
    std::vector<LinearContact> contacts;
    for (const std::uint32_t site : sites_) contacts.push_back({site, displacement});
    return held_patches(organ_.model, organ_.sites, organ_.rest, contacts);
  }

  const Organ& organ_;
  const std::vector<std::uint32_t>& sites_;
  StaticSolver solver_;
  LoadCase load_;      // load of the last frame
  Eigen::VectorXd u_;  // num_dofs: displacement of the last frame
};

}  // namespace

TimeSummary time_full_newton(const Organ& organ, const std::vector<std::uint32_t>& sites, double part,
                             int frames) {
  NewtonFrames newton(organ, sites);
  return time_calls(frames, [&](int frame) {
    newton.frame(Eigen::Vector3d(on_path(0, part * organ.scene.max_displacement, frame).displacement));
  });
}

}  // namespace palpate
