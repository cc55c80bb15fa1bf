// Linear methods that EPFE is compared with, on the organ at rest with the patches of some contacts held: a back-solve
// and a fixed tensor, both made for these contacts and no others, and localised conjugate gradients.
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
  double tolerance = 0;  // of LCG: of the residual, of what the contacts put on the free nodes
};

class HeldOrgan {
 public:
  // No two of the sites share a node. Cost: a factor. Throws std::runtime_error when the stiffness at rest is not
  // positive definite.
  HeldOrgan(const Organ& organ, const std::vector<size_t>& sites);
  HeldOrgan(const HeldOrgan&) = delete;  // its parts refer to one another
  HeldOrgan& operator=(const HeldOrgan&) = delete;

  // Whether each node is free or not as a whole, which LCG takes for granted.
  bool has_whole_nodes() const;

  // `displacement`: of each contact, three numbers each. Forces first, as a haptic frame, then the field of the packed
  // nodes; what a method has made in the haptic frame costs nothing in the visual one.
  void haptic(const HeldMethod& method, const Eigen::VectorXd& displacement);
  void visual(const HeldMethod& method, const Eigen::VectorXd& displacement);

  // Both, of contacts at the sites, in their order. LCG goes on from the answer before.
  MethodAnswer answer(const HeldMethod& method, const std::vector<LinearContact>& contacts);

 private:
  FixedTensor& tensor();
  LocalizedCg& localized_cg(double tolerance);

  HeldContacts held_;
  std::vector<int> shown_;       // of the free equations, those of packed nodes
  std::vector<int> shown_at_;    // where they stand in a field
  std::vector<int> contact_of_;  // of each number of a field; -1: it is not held
  BackSolve back_solve_;
  std::optional<FixedTensor> tensor_;
  std::map<double, LocalizedCg> localized_cg_;  // by tolerance
  Eigen::VectorXd force_;                       // of the last haptic frame
};

// A back-solve, PFE, and LCG to each of these tolerances.
std::vector<HeldMethod> held_methods(const std::vector<double>& tolerances);

}  // namespace palpate
