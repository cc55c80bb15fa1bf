// An organ as a deformable body of Bullet (https://github.com/bulletphysics/bullet3; Debian: libbullet-dev): the same
// mesh, the same moduli at small strain, nodes that tools hold moved by hand.
//
// A frame is one step of backward Euler, M (v' - v) = dt f(x + dt v'), by one Newton iteration whose linear system
// Bullet solves by conjugate gradients: all as a world of Bullet's does it, without collisions. Statics is where it
// settles.
//
// Its law (btDeformableNeoHookeanForce; Smith, De Goes and Kim 2018, Stable neo-Hookean flesh simulation) is not
// Zhong et al. 2005 eq. (1):
//
//   P = mu_b (1 - 1 / (tr C + 1)) F + (lambda_b (J - 1) - 3/4 mu_b) cof F
//
// With F = 1 + H and eps = sym H, to first order 1 - 1 / (tr C + 1) = 3/4 + tr eps / 8, J - 1 = tr eps and cof F = (1
// + tr eps) 1 - H^T, so that
//
//   P = 3/2 mu_b eps + (lambda_b - 5/8 mu_b) tr eps 1
//
// which is Hooke's law 2 mu eps + lambda tr eps 1 for mu_b = 4/3 mu, lambda_b = lambda + 5/6 mu.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate::study {

// Statics knows no mass. A body's is such that a shear wave takes so many of its frames through the organ's largest
// extent. With fewer it settles in fewer frames, with more conjugate gradients need fewer iterations in each.
// Bullet's damping is left out: backward Euler damps enough, and damping forces double what an iteration costs.
// Single precision is Debian's first choice: in double frames take twice as long, and what it settles to on the brain
// has the same errors to three digits.
inline constexpr double kFramesOfAWave = 10;

class BulletBody {
 public:
  // At rest. `held`: num_dofs, as of a LoadCase, whole nodes. Throws std::runtime_error with the reason where Bullet
  // cannot hold the model: elements of ten nodes or that share volumes, several Poisson's ratios, nodes held along
  // some axes alone.
  BulletBody(const Model& model, const std::vector<char>& held, double frames_of_a_wave = kFramesOfAWave);
  ~BulletBody();
  BulletBody(const BulletBody&) = delete;
  BulletBody& operator=(const BulletBody&) = delete;

  // One step, in which held nodes come to their place in `displacement` (num_dofs; read where held).
  void frame(const Eigen::VectorXd& displacement);

  // From rest, num_dofs; length unit. Not finite where Bullet's is not.
  Eigen::VectorXd displacement() const;
  // That the outside must apply, by Bullet's law in Bullet's positions: num_dofs; force unit.
  Eigen::VectorXd internal_force() const;
  // Forces on nodes that are not held, which have none in statics, as a part of those on held ones. Bullet takes a step
  // that is not a number for none: it shows here.
  double imbalance() const;
  // Smallest det F of an element.
  double smallest_jacobian() const;

  // "3.24".
  static std::string version();

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace palpate::study
