// Assembles internal force P(u), stored energy and tangent stiffness K(u) = dP/du of four-node and ten-node
// tetrahedra, on a fixed sparsity pattern. Elements of a volume patch share a pressure (shared_volumes.hpp).
//
// Source: Zhong et al. 2005 eqs. (4), (6), (10), total Lagrangian. With the shape gradients g_a at an
// integration point of volume V:
//   F = 1 + sum_a u_a g_a^T,   P_a = sum V P(F) g_a,   K_ab = sum V g_a . dP/dF . g_b.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "offline/fem/cholesky.hpp"
#include "offline/fem/shared_volumes.hpp"
#include "offline/mesh/model.hpp"
#include "offline/mesh/tetrahedron_shape.hpp"
#include "runtime/kernels/element_batch.hpp"

namespace palpate {

// A Newton iteration stalls if it leaves more than kStall of the last residual. After a stall a residual
// below kRoundings times Assembly::rounding_force() counts as rounding.
inline constexpr double kRoundings = 4;
inline constexpr double kStall = 0.3;

// The result of a pass over the elements. If min_jacobian <= 0, an element is inverted: forces are undefined.
struct ElementState {
  double min_jacobian = 1;  // smallest det F; 1 at small strain
  int worst_element = 0;    // index in Model::elements
};

class Assembly {
 public:
  // `eliminated` [num_dofs] marks the dofs that every solve holds at zero. These dofs and the dofs of nodes
  // without elements get no equation. Keeps a reference to `model`. The bits do not depend on `threads`.
  Assembly(const Model& model, const std::vector<char>& eliminated, int threads = 1);

  const Model& model() const { return *model_; }
  int threads() const { return threads_; }  // as constructed
  int num_dofs() const { return model_->num_dofs(); }
  int num_equations() const { return static_cast<int>(equation_dofs_.size()); }
  const std::vector<int>& equation_dofs() const { return equation_dofs_; }  // equation -> dof
  const std::vector<int>& dof_equations() const { return dof_equations_; }  // dof -> equation, or -1

  // Computes P(u) [num_dofs]: the forces that must act on the nodes from outside to hold `displacement`.
  // Computes the stored energy if `energy` is not null; the energy is infinite where an element is inverted.
  ElementState internal_force(const Eigen::VectorXd& displacement, Eigen::VectorXd& force,
                              double* energy = nullptr) const;

  // Computes the lower triangle of K(u) over the equations, with the same pattern in all calls. `project`
  // sets negative eigenvalues of dP/dF to zero, so that Newton's direction remains a descent direction.
  using SparseLower = palpate::SparseLower;
  void tangent(const Eigen::VectorXd& displacement, bool project, SparseLower& stiffness) const;

  // Returns the symbolic analysis of all tangents and computes it on the first call. Thread-safe.
  const CholeskyAnalysis& analysis() const;

  // Returns K(u) v for columns v of num_dofs rows, matrix-free.
  Eigen::MatrixXd tangent_times(const Eigen::VectorXd& displacement, const Eigen::MatrixXd& vectors) const;

  // Estimates the 2-norm of the rounding error of P(u). With eps = 2^-52, largest modulus A, largest shape
  // gradient g and largest displacement component |u|, a point of volume V has the errors
  //   eps (1 + |u| g) in F,   A eps (1 + |u| g) in the stress,   V g A eps (1 + |u| g) in nodal forces.
  // The errors of different points count as independent.
  double rounding_force(const Eigen::VectorXd& displacement) const;

 private:
  // Up to kLanes elements of one kind in a part, one in each lane.
  template <int kNodes>
  struct Batch : ElementBatch<kNodes> {
    std::array<int, kLanes> elements;   // in Model::elements
    std::array<int, kLanes> materials;  // in Model::materials
    int num_elements = 0;               // later lanes repeat the last element
    bool dyadic = false;                // has_dyadic_tangent() of all laws of the batch; else of none
    bool shares_volume = false;         // all elements belong to volume patches; else none does
  };
  // Positions of each lower triangle in the value array; -1 for eliminated dofs and entries of other parts.
  template <int kNodes>
  using Scatter = std::array<std::array<int, std::tuple_size_v<StiffnessLanes<kNodes>>>, kLanes>;
  // The elements that touch a part's nodes.
  template <int kNodes>
  struct Batches {
    std::vector<Batch<kNodes>> batches;
    std::vector<Scatter<kNodes>> scatter;  // one for each batch; separate because forces do not read it
  };
  struct Part {
    Batches<4> linear;
    Batches<10> quadratic;
    std::vector<int> patches;       // volume patches that touch the part's nodes
    std::vector<int> patch_places;  // positions of the patches' lower triangles, patch after patch
  };

  int first_equation(int node) const;  // of the node's first dof with an equation, or -1
  void divide_nodes(int parts);
  void set_pattern();
  template <int kNodes>
  void make_batches();
  template <int kNodes>
  Scatter<kNodes> scatter_of(int part, const Batch<kNodes>& batch) const;
  // Computes the positions of a lower triangle over these nodes' dofs, column by column.
  void places_of(int part, std::span<const int> nodes, std::span<int> places) const;
  void place_patches();
  bool owns(int part, int node) const { return node_part_[static_cast<size_t>(node)] == part; }
  template <bool kShares, int kNodes>
  const Law& law(const Batch<kNodes>& batch, int lane) const;
  // Returns the law of a lane's element: W' of volume_split.hpp if the element shares a volume.
  template <int kNodes>
  const Law& law(const Batch<kNodes>& batch, int lane) const;
  // Returns the pressure U' of the volume patch of a lane's element.
  template <int kNodes>
  double pressure(const SharedVolumes::State& volumes, const Batch<kNodes>& batch, int lane) const;
  // Computes volumes, pressures and, on request, volume gradients. Empty without volume patches.
  SharedVolumes::State volume_state(const Eigen::VectorXd& displacement, bool with_gradients) const;
  // Adds U''/V_p G G^T of each volume patch to the values of the stiffness.
  void add_dyads(const SharedVolumes::State& volumes, double* values) const;
  // Calls work(part, batch, scatter, std::bool_constant<shares volume>) for each batch; a part has a thread.
  template <typename Work>
  void for_each_batch(Work&& work) const;

  const Model* model_;
  SharedVolumes volumes_;
  std::vector<Law> laws_without_volume_;  // per material: W' of volume_split.hpp
  int threads_;
  // The nodes are divided into slabs across the longest side of the body. Each part sums the contributions to
  // its own nodes, in the order of make_batches(). Each part computes every element that touches its nodes.
  std::vector<Part> parts_;
  std::vector<int> node_part_;
  std::vector<int> dof_equations_;
  std::vector<int> equation_dofs_;
  SparseLower pattern_;
  struct LazyAnalysis {
    std::once_flag computed;
    std::optional<CholeskyAnalysis> analysis;
  };
  std::shared_ptr<LazyAnalysis> analysis_ = std::make_shared<LazyAnalysis>();
  double rounding_at_rest_ = 0;     // norm of A V g over the elements
  double rounding_per_length_ = 0;  // norm of A V g^2
};

}  // namespace palpate
