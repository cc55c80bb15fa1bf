// Assembles internal force P(u), stored energy and tangent stiffness K(u) = dP/du of an organ of tetrahedra with four
// or ten nodes. The sparsity pattern is fixed once. Elements of a volume patch share a pressure (shared_volumes.hpp).
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

// Once a Newton iteration leaves more than kStall of the residual before it, a residual below kRoundings times
// Assembly::rounding_force counts as rounding.
inline constexpr double kRoundings = 4;
inline constexpr double kStall = 0.3;

// The result of one pass over the elements. `min_jacobian`: smallest det F (1 at small strain). At
// min_jacobian <= 0 an element is inverted and the forces are undefined.
struct ElementState {
  double min_jacobian = 1;
  int worst_element = 0;  // index in Model::elements
};

class Assembly {
 public:
  // `eliminated` (num_dofs entries): dofs that every solve holds at zero; they get no equation. Dofs of nodes without
  // elements are eliminated too. Keeps a reference to `model`. The result does not depend on `threads` to the bit.
  Assembly(const Model& model, const std::vector<char>& eliminated, int threads = 1);

  const Model& model() const { return *model_; }
  int threads() const { return threads_; }  // as constructed
  int num_dofs() const { return model_->num_dofs(); }
  int num_equations() const { return static_cast<int>(equation_dofs_.size()); }
  const std::vector<int>& equation_dofs() const { return equation_dofs_; }  // equation -> dof
  const std::vector<int>& dof_equations() const { return dof_equations_; }  // dof -> equation, or -1

  // P(u), all num_dofs entries: the force that the outside must apply at each node to hold `displacement`.
  // With `energy` also the stored energy, +infinity where an element is inverted.
  ElementState internal_force(const Eigen::VectorXd& displacement, Eigen::VectorXd& force,
                              double* energy = nullptr) const;

  // Lower triangle of K(u) over the equations: compressed columns, rows ascending, one pattern for all calls. With
  // `project` each negative eigenvalue of dP/dF is set to zero. Newton's direction then remains a descent direction.
  using SparseLower = palpate::SparseLower;
  void tangent(const Eigen::VectorXd& displacement, bool project, SparseLower& stiffness) const;

  // The symbolic analysis for all Cholesky factors of tangents, computed on the first call. Thread-safe.
  const CholeskyAnalysis& analysis() const;

  // K(u) v for full-length vectors, matrix-free: shape (num_dofs, columns).
  Eigen::MatrixXd tangent_times(const Eigen::VectorXd& displacement, const Eigen::MatrixXd& vectors) const;

  // 2-norm of the rounding error of P(u). With eps = 2^-52, largest modulus A and largest shape gradient g of
  // an element:
  //   error of F = eps (1 + |u| g),   of the stress A times that error,   of nodal forces V g times the stress error.
  // The errors of elements are independent.
  double rounding_force(const Eigen::VectorXd& displacement) const;

 private:
  // A batch: four elements of one kind in a part.
  template <int kNodes>
  struct Batch : ElementBatch<kNodes> {
    std::array<int, kLanes> elements;   // in Model::elements
    std::array<int, kLanes> materials;  // in Model::materials
    int num_elements = 0;               // later lanes repeat the last element
    bool dyadic = false;                // all laws of the batch have a dyadic tangent; else none has
    bool shares_volume = false;         // all elements belong to volume patches; else none does
  };
  // Positions of each element's lower triangle in the value array; -1 for eliminated dofs and for entries of
  // other parts.
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

  int first_equation(int node) const;  // first free dof's equation, or -1
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
  // W' (volume_split.hpp) for elements that share a volume
  template <int kNodes>
  const Law& law(const Batch<kNodes>& batch, int lane) const;
  // U' of the patch of a lane's element.
  template <int kNodes>
  double pressure(const SharedVolumes::State& volumes, const Batch<kNodes>& batch, int lane) const;
  // Empty without volume patches.
  SharedVolumes::State volume_state(const Eigen::VectorXd& displacement, bool with_gradients) const;
  void add_dyads(const SharedVolumes::State& volumes, double* values) const;
  // Calls work(part, batch, scatter, std::bool_constant<shares volume>) for each batch. Each part runs on its
  // own thread.
  template <typename Work>
  void for_each_batch(Work&& work) const;

  const Model* model_;
  SharedVolumes volumes_;
  std::vector<Law> laws_without_volume_;  // per material: W' of volume_split.hpp
  int threads_;
  // The nodes are divided into slabs across the longest side of the body. Each part sums the contributions to
  // its own nodes, in the order of make_batches(). Both parts compute an element on their border.
  std::vector<Part> parts_;
  std::vector<int> node_part_;
  std::vector<int> dof_equations_;
  std::vector<int> equation_dofs_;
  SparseLower pattern_;
  struct LazyAnalysis {
    std::once_flag made;
    std::optional<CholeskyAnalysis> analysis;
  };
  std::shared_ptr<LazyAnalysis> analysis_ = std::make_shared<LazyAnalysis>();
  double rounding_at_rest_ = 0;     // norm of A V g over the elements
  double rounding_per_length_ = 0;  // norm of A V g^2
};

}  // namespace palpate
