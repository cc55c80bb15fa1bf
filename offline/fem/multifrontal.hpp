// Numeric Cholesky factor of a sparse matrix by the multifrontal method, on several threads, in double or
// single precision.
//
// The work is dense BLAS on the fronts of a FrontTree (which derives it). Disjoint subtrees, the *branches*,
// are eliminated side by side; what stands above them, the *trunk*, after them. Every front is made by the
// same operations in the same order whoever does it, so the bits do not depend on the threads. BLAS must be
// single-threaded (openblas_set_num_threads(1)) where branches run side by side.
//
// Updates wait for their parent on stacks. In postorder all that lies above the updates of a front's children
// is gone when the front is made, but its own update must be made before theirs are dropped; two stacks, for
// even and odd depth, let it.
#pragma once

#include <memory>
#include <vector>

#include "offline/fem/front_tree.hpp"

namespace palpate {

// Real: double or float. One object a thread; not copyable. `tree` must outlive it.
template <typename Real>
class Multifrontal {
 public:
  Multifrontal(const FrontTree& tree, int threads);

  // Factor of the matrix with these values on the tree's pattern. False where it is not positive definite to
  // the rounding of Real; solve() must then not be called.
  [[nodiscard]] bool factorize(const double* values);

  // Replaces `columns` columns of one entry an equation, one after another, by K^-1 times them.
  void solve(double* right_hand_sides, int columns);

 private:
  // Updates that wait.
  struct Stacks {
    std::unique_ptr<Real[]> entries[2];
    size_t top[2] = {0, 0};
  };
  struct Branch {
    int root;
    Stacks stacks;
  };

  void divide(int threads);
  void reserve(Stacks& stacks, const std::vector<int>& fronts) const;
  bool eliminate(int front, Stacks& stacks);
  void add_children(int front, Real* panel, Real* update, bool above) const;
  template <typename Work>
  void for_each_branch(Work&& work);

  const FrontTree* tree_;
  int threads_;
  std::vector<Branch> branches_;  // the most costly first
  std::vector<int> trunk_;
  Stacks trunk_stacks_;
  std::unique_ptr<Real[]> panels_;
  std::vector<Real*> updates_;  // of every front, where they wait
  const double* values_ = nullptr;
  double scale_ = 1;           // of the matrix that is factored, a power of two
  std::vector<Real> carried_;  // of solve: one entry a row of every front and column
};

extern template class Multifrontal<double>;
extern template class Multifrontal<float>;

}  // namespace palpate
