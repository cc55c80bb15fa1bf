// Linear reference methods for EPFE on the organ at rest, with fixed contacts: a back-solve, a fixed tensor,
// and localised conjugate gradients.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/measured_push.hpp"
#include "offline/study/back_solve.hpp"
#include "offline/study/fixed_tensor.hpp"
#include "offline/study/localized_cg.hpp"
#include "offline/study/organ_measurements.hpp"

namespace palpate {

struct HeldMethod {
  MethodKind kind = MethodKind::back_solve;
  std::string name;
  double tolerance = 0;  // for LCG: residual relative to the contacts' force on the free nodes
};

class HeldOrgan {
 public:
  // The sites must share no node. Cost: a factor. Throws std::runtime_error when the stiffness at rest is not
  // positive definite.
  HeldOrgan(const Organ& organ, const std::vector<size_t>& sites);
  HeldOrgan(const HeldOrgan&) = delete;  // its parts refer to one another
  HeldOrgan& operator=(const HeldOrgan&) = delete;

  // Whether each node has either three free dofs or none; LCG requires it.
  bool has_whole_nodes() const;

  // `displacement`: three numbers for each contact. haptic() computes the forces, visual() the field of the
  // packed nodes; visual() reuses results of haptic().
  void haptic(const HeldMethod& method, const Eigen::VectorXd& displacement);
  void visual(const HeldMethod& method, const Eigen::VectorXd& displacement);

  // Computes forces and field for contacts at the sites, in their order. LCG starts from the response before.
  MethodAnswer answer(const HeldMethod& method, const std::vector<LinearContact>& contacts);

 private:
  FixedTensor& tensor();
  LocalizedCg& localized_cg(double tolerance);

  HeldContacts held_;
  std::vector<int> shown_;       // free equations of packed nodes
  std::vector<int> shown_at_;    // their positions in a field
  std::vector<int> contact_of_;  // contact dof of each number of a field; -1: not held
  BackSolve back_solve_;
  std::optional<FixedTensor> tensor_;
  std::map<double, LocalizedCg> localized_cg_;  // by tolerance
  Eigen::VectorXd force_;                       // forces of the last haptic frame
};

// Returns a back-solve, PFE, and LCG for each tolerance.
std::vector<HeldMethod> held_methods(const std::vector<double>& tolerances);

}  // namespace palpate
