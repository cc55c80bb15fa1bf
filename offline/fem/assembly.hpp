// The discrete equations of an organ: internal force P(u), stored energy and tangent stiffness K(u) = dP/du,
// assembled from tetrahedra of four and ten nodes on a sparsity pattern that is fixed once.
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
#include <vector>

#include "offline/fem/cholesky.hpp"
#include "offline/material/constitutive_response.hpp"
#include "offline/mesh/model.hpp"
#include "offline/mesh/tetrahedron_shape.hpp"

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
  // The elements of one kind: where they are, their rest geometry, and where their stiffness goes.
  template <int kNodes>
  struct Group {
    static constexpr int kDofs = 3 * kNodes;
    static constexpr int kEntries = kDofs * (kDofs + 1) / 2;
    using Points = std::array<ShapeAtPoint<kNodes>, TetrahedronShape<kNodes>::kPoints>;
    std::vector<int> elements;  // in Model::elements
    std::vector<Points> rest;
    std::vector<std::vector<int>>
        of_part;  // the elements that touch a part's nodes, as indices in `elements`
    // For each element the lower triangle of its stiffness (a >= b over its dofs, column by column) as
    // positions in the value array, or -1 where a dof is eliminated.
    std::vector<std::array<int, kEntries>> scatter;
  };

  template <typename Visitor>
  void for_each_group(Visitor&& visit) const {
    visit(linear_);
    visit(quadratic_);
  }
  template <int kNodes>
  Eigen::Matrix<double, 3, kNodes> nodal_values(int element, const double* values) const;
  int first_equation(int node) const;  // of its free dofs, or -1
  void set_pattern();
  template <int kNodes>
  void set_scatter(Group<kNodes>& group) const;
  const Law& law(int element) const;
  // Calls work(part) for each part, each on a thread of its own.
  template <typename Work>
  void for_each_part(Work&& work) const;
  void divide_nodes(int parts);

  const Model* model_;
  int threads_;
  // The nodes are divided into slabs across the longest side of the body. A part adds up what belongs to its
  // nodes, in the order of the elements; those on the border of two parts are computed by both.
  int num_parts_ = 1;
  std::vector<int> node_part_;
  Group<4> linear_;
  Group<10> quadratic_;
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
