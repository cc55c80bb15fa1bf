// What an organ is answered with where nothing is learned beforehand: a back-solve of the linear factor, and Newton's
// method on the full model, each frame from the one before.
#pragma once

#include <Eigen/Core>
#include <map>

#include "offline/cli/carried_scene.hpp"
#include "offline/cli/measured_push.hpp"
#include "offline/precompute/tied_patch.hpp"

namespace palpate {

// The linear organ in float64, by one factor at rest: a frame is a matrix of 3 columns times d and one back-solve. One
// contact.
class BackSolver {
 public:
  // Throws std::runtime_error when the stiffness at rest is not positive definite.
  explicit BackSolver(const Organ& organ);

  MethodAnswer answer(const std::vector<LinearContact>& contacts);

 private:
  struct Patch {
    Eigen::MatrixXd loads;  // nodal, per displacement of the patch: num_dofs x 3
    Eigen::Matrix3d stiffness;
  };
  const Patch& patch_of(size_t site);

  const Organ* organ_;
  StaticSolver solver_;
  std::map<size_t, Patch> patches_;
};

// Full Newton, warm: the state of the frame before, its patch moved on, and as many iterations as that takes to converge.
class NewtonFrames {
 public:
  NewtonFrames(const Organ& organ, size_t site);

  // Throws std::runtime_error where there is no equilibrium.
  void frame(const Eigen::Vector3d& displacement);

 private:
  const Organ* organ_;
  size_t site_;
  StaticSolver solver_;
  LoadCase load_;
  Eigen::VectorXd u_;
};

}  // namespace palpate
