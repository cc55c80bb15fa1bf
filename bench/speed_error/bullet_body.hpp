// An organ as a deformable body of Bullet (https://github.com/bulletphysics/bullet3; Debian: libbullet-dev):
// the same mesh, the same moduli at small strain, held nodes moved by hand.
//
// A frame is a step of backward Euler, M (v' - v) = dt f(x + dt v'), without collisions. Bullet makes one
// Newton iteration by conjugate gradients. The settled state is the static solution.
//
// Bullet's law (btDeformableNeoHookeanForce; Smith, De Goes and Kim 2018, Stable neo-Hookean flesh
// simulation) differs from Zhong et al. 2005 eq. (1):
//   P = mu_b (1 - 1 / (tr C + 1)) F + (lambda_b (J - 1) - 3/4 mu_b) cof F
// Let F = 1 + H and eps = sym H. To first order 1 - 1 / (tr C + 1) = 3/4 + tr eps / 8, J - 1 = tr eps and
// cof F = (1 + tr eps) 1 - H^T. Hence
//   P = 3/2 mu_b eps + (lambda_b - 5/8 mu_b) tr eps 1
// equals Hooke's law 2 mu eps + lambda tr eps 1 for mu_b = 4/3 mu, lambda_b = lambda + 5/6 mu.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate::study {

// Frames that a shear wave takes through the organ's largest extent. This number sets the density, which has
// no influence on the settled state. Fewer frames settle sooner but need more conjugate gradient iterations
// each. Bullet's damping is off, because backward Euler damps enough. Single precision is Debian's default.
inline constexpr double kFramesOfAWave = 10;

class BulletBody {
 public:
  // Builds the body at rest. `held`: num_dofs, as in a LoadCase, whole nodes. Throws std::runtime_error with
  // the reason where Bullet cannot represent the model:
  // - elements of ten nodes or with shared volumes;
  // - several Poisson's ratios;
  // - nodes held along some axes only.
  BulletBody(const Model& model, const std::vector<char>& held, double frames_of_a_wave = kFramesOfAWave);
  ~BulletBody();
  BulletBody(const BulletBody&) = delete;
  BulletBody& operator=(const BulletBody&) = delete;

  // Runs one step. Held nodes move to their place in `displacement` (num_dofs; read only where held).
  void frame(const Eigen::VectorXd& displacement);

  // Returns the displacement from rest: num_dofs, length unit. Not finite where Bullet's state is not.
  Eigen::VectorXd displacement() const;
  // Returns the external forces that hold Bullet's positions, by Bullet's law: num_dofs, force unit.
  Eigen::VectorXd internal_force() const;
  // Returns the residual: force on free over force on held nodes. A skipped NaN step leaves a large residual.
  double imbalance() const;
  // Returns the smallest det F over all elements.
  double smallest_jacobian() const;

  // Returns Bullet's version: "3.24".
  static std::string version();

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace palpate::study
