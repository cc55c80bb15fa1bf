// The discrete equations of an organ: internal force P(u), stored energy and tangent stiffness K(u) = dP/du,
// assembled from tetrahedra of four and ten nodes on a sparsity pattern that is fixed once. Elements of a volume
// patch have the pressure that they share (shared_volumes.hpp).
//
// Source: Zhong et al. 2005 eqs. (4), (6), (10), in the reference configuration (total Lagrangian): with the
// shape gradients g_a at an integration point that stands for the volume V,
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
#include "offline/material/constitutive_response.hpp"
#include "offline/mesh/model.hpp"
#include "offline/mesh/tetrahedron_shape.hpp"
#include "runtime/kernels/element_batch.hpp"

namespace palpate {

// What one pass over the elements found. `min_jacobian` is the smallest det F (1 at small strain); at or
// below 0 an element is inverted and the forces beside it mean nothing.
struct ElementState {
  double min_jacobian = 1;
  int worst_element = 0;  // index in Model::elements
};

class Assembly {
 public:
  // `eliminated` (num_dofs entries): degrees of freedom that no solve will ever free; they leave the
  // equations. Those of nodes without elements are eliminated too. Keeps a reference to `model`. Forces and
  // tangents are made by so many threads, with the same bits whatever their number.
  Assembly(const Model& model, const std::vector<char>& eliminated, int threads = 1);

  const Model& model() const { return *model_; }
  int threads() const { return threads_; }  // that it was made with
  int num_dofs() const { return model_->num_dofs(); }
  int num_equations() const { return static_cast<int>(equation_dofs_.size()); }
  const std::vector<int>& equation_dofs() const { return equation_dofs_; }  // equation -> dof
  const std::vector<int>& dof_equations() const { return dof_equations_; }  // dof -> equation, or -1

  // P(u), all num_dofs entries: the force the outside must apply at every node to hold `displacement`. With
  // `energy`, the stored energy too, +infinity where an element is inverted.
  ElementState internal_force(const Eigen::VectorXd& displacement, Eigen::VectorXd& force,
                              double* energy = nullptr) const;

  // Lower triangle of K(u) over the equations, compressed columns, rows ascending. All calls share the
  // pattern. With `project`, the tangent of every element is first made positive semi-definite (negative
  // eigenvalues of dP/dF set to zero), which keeps Newton's direction one of descent where the true tangent
  // is indefinite.
  using SparseLower = palpate::SparseLower;
  void tangent(const Eigen::VectorXd& displacement, bool project, SparseLower& stiffness) const;

  // The analysis that every Cholesky factor of a tangent starts from; made when first asked for. Thread-safe.
  const CholeskyAnalysis& analysis() const;

  // K(u) v for full-length vectors, without assembling: shape (num_dofs, columns).
  Eigen::MatrixXd tangent_times(const Eigen::VectorXd& displacement, const Eigen::MatrixXd& vectors) const;

  // The 2-norm of what rounding leaves in P(u), however exact u is. With eps = 2^-52, A an element's largest
  // modulus and g the largest of its shape gradients, F = 1 + sum_a u_a g_a^T is known to eps (1 + |u| g),
  // its stress to A times that, and its nodal forces to V g times the stress; elements round independently.
  double rounding_force(const Eigen::VectorXd& displacement) const;

 private:
  // Four elements of one kind that a part computes.
  template <int kNodes>
  struct Batch : ElementBatch<kNodes> {
    std::array<int, kLanes> elements;   // in Model::elements
    std::array<int, kLanes> materials;  // in Model::materials
    int num_elements = 0;               // the lanes after them repeat the last one
    bool dyadic = false;                // the laws of all have a dyadic tangent; of none otherwise
    bool shares_volume = false;         // all are of volume patches; of none otherwise
  };
  // The lower triangle of each element's stiffness as positions in the value array; -1 where a dof is
  // eliminated or the place is another part's.
  template <int kNodes>
  using Scatter = std::array<std::array<int, std::tuple_size_v<StiffnessLanes<kNodes>>>, kLanes>;
  // The elements that touch a part's nodes.
  template <int kNodes>
  struct Batches {
    std::vector<Batch<kNodes>> batches;
    std::vector<Scatter<kNodes>> scatter;  // of each; apart, as forces do not read it
  };
  struct Part {
    Batches<4> linear;
    Batches<10> quadratic;
    std::vector<int> patches;       // volume patches that touch its nodes
    std::vector<int> patch_places;  // the lower triangles of their dyads, one behind the other
  };

  int first_equation(int node) const;  // of its free dofs, or -1
  void divide_nodes(int parts);
  void set_pattern();
  template <int kNodes>
  void make_batches();
  template <int kNodes>
  Scatter<kNodes> scatter_of(int part, const Batch<kNodes>& batch) const;
  // Where the lower triangle of a matrix over these nodes' dofs goes, column by column.
  void places_of(int part, std::span<const int> nodes, std::span<int> places) const;
  void place_patches();
  bool owns(int part, int node) const { return node_part_[static_cast<size_t>(node)] == part; }
  template <bool kShares, int kNodes>
  const Law& law(const Batch<kNodes>& batch, int lane) const;
  template <int kNodes>
  const Law& law(const Batch<kNodes>& batch, int lane) const;  // W', where volumes are shared
  // U' of the patch of a lane's element.
  template <int kNodes>
  double pressure(const SharedVolumes::State& volumes, const Batch<kNodes>& batch, int lane) const;
  // Empty where no volumes are shared.
  SharedVolumes::State volume_state(const Eigen::VectorXd& displacement, bool with_gradients) const;
  void add_dyads(const SharedVolumes::State& volumes, double* values) const;
  // Calls work(part, batch, its scatter, std::bool_constant of whether it shares volumes) for each batch, each part
  // on a thread of its own.
  template <typename Work>
  void for_each_batch(Work&& work) const;

  const Model* model_;
  SharedVolumes volumes_;
  std::vector<Law> laws_without_volume_;  // of each material: W' of volume_split.hpp
  int threads_;
  // The nodes are divided into slabs across the longest side of the body. A part adds up what belongs to its
  // nodes, in an order of the elements that is the same for all (make_batches); those on the border of two
  // parts are computed by both.
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
