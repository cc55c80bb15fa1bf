// Volume changes that several elements, or the points of one element, share (mean dilatation).
//
// Source: Nagtegaal, Parks and Rice 1974; Simo, Taylor and Pister 1985 for one element; de Souza Neto,
// Andrade Pires and Owen 2005 for patches of tetrahedra, without an energy. Here an energy defines the
// method. With W = W' + U(theta) of volume_split.hpp, a patch p of points q with volumes V_q stores
//
//   sum_q V_q W'(F_q) + V_p U(theta_p),   V_p = sum_q V_q,   theta_p = sum_q V_q theta(F_q) / V_p.
//
// The patch has a constant pressure U'(theta_p). With G = d(V_p theta_p)/du = sum_q V_q dtheta/dF_q . g_a:
//
//   P_q = dW'/dF + U' dtheta/dF,   K = sum_q V_q g_a . (d2W' + U' d2theta) . g_b + U''/V_p G G^T
//
// K is symmetric and couples only nodes of the patch. K is positive definite where both terms are. Assembly
// computes V_q theta, its gradient and the terms inside the sums. This class computes pressures and G G^T.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

class SharedVolumes {
 public:
  // Keeps a reference to `model`.
  explicit SharedVolumes(const Model& model);

  bool empty() const { return volumes_.empty(); }
  int num_patches() const { return static_cast<int>(volumes_.size()); }
  std::span<const int> nodes(int patch) const;
  // Patch number of an element; -1 where the element shares its volume with no other point.
  int patch_of(int element) const { return patch_of_[static_cast<std::size_t>(element)]; }

  struct State {
    // Per element: sum over its points of V theta, and the gradient of the sum at the element's nodes.
    std::vector<double> volumes;
    std::vector<std::array<double, 30>> gradients;  // empty unless requested
    // Per patch: U' and U''.
    std::vector<double> pressures;
    std::vector<double> stiffnesses;
    double energy = 0;  // sum of V_p U
  };
  // Returns volumes of zero; the caller sets volumes and, if requested, gradients of the elements.
  State begin(bool with_gradients) const;
  // Computes pressures, stiffnesses and energy from the volumes of the elements.
  void finish(State& state) const;

  // Computes G: three entries for each node of the patch.
  void gradient(const State& state, int patch, std::vector<double>& gradient) const;
  // Returns U'' / V_p, the factor of G G^T.
  double dyad_scale(const State& state, int patch) const;

 private:
  const Model* model_;
  std::vector<int> patch_of_;
  // Elements and nodes patch after patch: patch p has the entries from starts[p] to starts[p + 1].
  std::vector<int> elements_;
  std::vector<std::size_t> element_starts_;
  std::vector<int> nodes_;  // ascending in each patch
  std::vector<std::size_t> node_starts_;
  std::vector<double> volumes_;  // V_p
};

}  // namespace palpate
