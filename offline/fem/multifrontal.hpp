// Numeric factor K = L S L^T of a sparse symmetric matrix by the multifrontal method, threaded, in double or
// single precision. S = 1 gives the Cholesky factor. Otherwise S holds the signs of the pivots. The number of
// negative signs is the number of negative eigenvalues of K (Sylvester's law of inertia).
//
// The factor exchanges no pivots. An indefinite K may meet an accidentally small pivot and a large L; the
// caller must check the residual.
//
// The work is dense BLAS on the fronts of a FrontTree. Threads eliminate disjoint subtrees, the *branches*,
// side by side, then the *trunk* above them. The order of operations in a front is fixed, so the bits do not
// depend on the threads. BLAS itself must be single-threaded (openblas_set_num_threads(1)).
//
// Pending updates wait for their parent on stacks. A front pushes its update before it pops its children's
// updates. Two stacks, for even and odd depth, make this order possible. A branch uses its thread's stacks
// and stores its root's update for the trunk.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "offline/fem/front_tree.hpp"

namespace palpate {

enum class Pivots { positive, of_either_sign };

// Real: double or float. One object for each thread; not copyable. `tree` must outlive the object.
template <typename Real>
class Multifrontal {
 public:
  // Allocates all memory of a factor: panel_entries() of the tree and the stacks. Throws std::bad_alloc.
  Multifrontal(const FrontTree& tree, int threads);

  // Factors the matrix with these values on the tree's pattern. Cost: sum of Front::operations. Returns
  // false, and solve() is then invalid, where:
  //   1. pivots must be positive and the matrix is not positive definite to the rounding of Real, or
  //   2. pivots may have either sign and a pivot is rounding.
  [[nodiscard]] bool factorize(const double* values, Pivots pivots = Pivots::positive);
  int num_negative_pivots() const;  // for the last factor

  // Replaces each of `columns` contiguous columns b by K^-1 b. Cost: two passes over L for each 16 columns.
  // Throws std::bad_alloc.
  void solve(double* right_hand_sides, int columns);

 private:
  struct Workspace {                   // memory of one thread
    std::unique_ptr<Real[]> stack[2];  // pending updates, at even and odd depth
    std::array<size_t, 2> top;         // entries in use of each stack
    std::vector<Real> diagonal;        // scaled diagonal of K in the front's columns
  };
  struct Branch {
    int root;
    std::unique_ptr<Real[]> update;  // the root's update, for the trunk
  };

  void divide();
  void track_stacks(int front, std::array<size_t, 2>& top, std::array<size_t, 2>& peak) const;
  bool eliminate(int front, Workspace& workspace, int threads);
  void add_children(int front, Real* panel, Real* update, bool to_update) const;
  Real* carried(const Front& front, size_t columns) { return carried_.data() + front.rows_start * columns; }
  void forward(int front, const double* b, const std::vector<double>& scales);
  void backward(int front, const std::vector<double>& scales, double* solutions);
  void solve_block(double* right_hand_sides, int columns);

  const FrontTree* tree_;
  int threads_;
  std::vector<Branch> branches_;  // in descending order of cost
  std::vector<char> is_branch_root_;
  std::vector<int> trunk_;
  std::vector<Workspace> workers_;
  Workspace trunk_workspace_;
  std::unique_ptr<Real[]> panels_;  // L11 and L21 of every front
  std::vector<Real*> updates_;      // address of every front's update
  const double* values_ = nullptr;
  Pivots pivots_ = Pivots::positive;
  std::vector<char> negative_;  // for every column of L: whether S is -1
  double scale_ = 1;            // scale of the factored matrix, a power of two
  std::vector<Real> carried_;   // w of solve_block(), for all rows of every front and each column
};

extern template class Multifrontal<double>;
extern template class Multifrontal<float>;

}  // namespace palpate
