// Numeric factor K = L S L^T of a sparse symmetric matrix by the multifrontal method, on several threads, in
// double or single precision. S is 1, the Cholesky factor, or holds the signs of the pivots, of which there
// are as many below zero as K has negative eigenvalues (Sylvester's law of inertia).
//
// Pivots are not exchanged: one may be small by chance where K is indefinite, and L large beside it. Whoever
// allows either sign looks at the residual of what is solved.
//
// The work is dense BLAS on the fronts of a FrontTree (which derives it). Disjoint subtrees, the *branches*,
// are eliminated side by side; what stands above them, the *trunk*, after them. Every front is made by the
// same operations in the same order whoever does it, so the bits do not depend on the threads. BLAS must be
// single-threaded (openblas_set_num_threads(1)) where branches run side by side.
//
// Updates wait for their parent on stacks. In postorder all that lies above the updates of a front's children
// is gone when the front is made, but its own update must be made before theirs are dropped; two stacks, for
// even and odd depth, let it. A branch has the stacks of the thread that makes it, and puts its root's update
// aside for the trunk.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "offline/fem/front_tree.hpp"

namespace palpate {

enum class Pivots { positive, of_either_sign };

// Real: double or float. One object a thread; not copyable. `tree` must outlive it.
template <typename Real>
class Multifrontal {
 public:
  // Takes all the memory that factors need: panel_entries() of the tree and what waits on the stacks. Throws
  // std::bad_alloc.
  Multifrontal(const FrontTree& tree, int threads);

  // Factor of the matrix with these values on the tree's pattern. False where it is not positive definite to
  // the rounding of Real or, with pivots of either sign, where one is only rounding; solve() must then not be
  // called. Cost: the sum of Front::operations.
  [[nodiscard]] bool factorize(const double* values, Pivots pivots = Pivots::positive);
  int num_negative_pivots() const;  // of the last factor

  // Replaces `columns` columns of one entry an equation, one after another, by K^-1 times them. Cost: two
  // passes over L for each 16 columns. Throws std::bad_alloc.
  void solve(double* right_hand_sides, int columns);

 private:
  struct Workspace {                   // of one thread
    std::unique_ptr<Real[]> stack[2];  // updates that wait for their parent, at even and odd depth
    std::array<size_t, 2> top;
    std::vector<Real> diagonal;  // of the front's columns, before the elimination
  };
  struct Branch {
    int root;
    std::unique_ptr<Real[]> update;  // of its root, for the trunk
  };

  void divide();
  void wait(int front, std::array<size_t, 2>& top, std::array<size_t, 2>& most) const;
  bool eliminate(int front, Workspace& workspace, int threads);
  void add_children(int front, Real* panel, Real* update, bool above) const;
  void solve_block(double* right_hand_sides, int columns);

  const FrontTree* tree_;
  int threads_;
  std::vector<Branch> branches_;  // the most costly first
  std::vector<char> is_branch_root_;
  std::vector<int> trunk_;
  std::vector<Workspace> workers_;
  Workspace trunk_workspace_;
  std::unique_ptr<Real[]> panels_;  // L11 and L21 of every front
  std::vector<Real*> updates_;      // of every front, where they wait
  const double* values_ = nullptr;
  Pivots pivots_ = Pivots::positive;
  std::vector<char> negative_;  // whether S is -1, of every column of L
  double scale_ = 1;            // of the matrix that is factored, a power of two
  std::vector<Real> carried_;   // of solve_block: one entry a row of every front and column
};

extern template class Multifrontal<double>;
extern template class Multifrontal<float>;

}  // namespace palpate
