// The sparse Cholesky factorisation, compared with Eigen's dense factorisation.
#include "offline/fem/cholesky.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <thread>
#include <vector>

#include "offline/fem/assembly.hpp"
#include "offline/numerics/decompositions.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace cholesky_test {

using test::TestRandom;

// Condition of the matrices below (under 1e3) times double rounding, with reserve.
constexpr double kSolve = 1e-12;

// A random pattern with about `per_row` entries left of the diagonal in a row.
struct RandomMatrix {
  SparseLower lower;
  Eigen::MatrixXd dense;
};

RandomMatrix random_matrix(int n, int per_row, unsigned pattern_seed, unsigned value_seed) {
  TestRandom places(pattern_seed);
  TestRandom values(value_seed);
  RandomMatrix result;
  result.dense = Eigen::MatrixXd::Zero(n, n);
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixXd occupied = Eigen::MatrixXd::Zero(n, n);
  for (int row = 1; row < n; ++row) {
    for (int k = 0; k < per_row; ++k) {
      const int column = static_cast<int>(0.5 * (places() + 1) * row);
      if (occupied(row, column) != 0) continue;
      occupied(row, column) = 1;
      result.dense(row, column) = result.dense(column, row) = values();
    }
  }
  // Slightly diagonally dominant: positive definite, and sensitive to an error in any entry.
  for (int row = 0; row < n; ++row) result.dense(row, row) = result.dense.row(row).cwiseAbs().sum() + 0.1;
  for (int column = 0; column < n; ++column) {
    for (int row = column; row < n; ++row) {
      if (row == column || occupied(row, column) != 0)
        entries.emplace_back(row, column, result.dense(row, column));
    }
  }
  result.lower.resize(n, n);
  result.lower.setFromTriplets(entries.begin(), entries.end());
  return result;
}

TEST(CholeskyReference, SolvesAsADenseFactorDoes) {
  for (const int n : {1, 2, 17, 150}) {
    const RandomMatrix matrix = random_matrix(n, 4, 21, 22);
    Cholesky cholesky{CholeskyAnalysis(matrix.lower)};
    ASSERT_TRUE(cholesky.factorize(matrix.lower));
    const Eigen::VectorXd right = TestRandom(23).vector(n);
    Eigen::VectorXd solution = right;
    cholesky.solve(solution);
    const Eigen::VectorXd expected = solve_definite(matrix.dense, right);
    EXPECT_LE((solution - expected).norm(), kSolve * expected.norm()) << n;
  }
}

TEST(CholeskyReference, SolvesManyColumnsAtOnce) {
  const int n = 120;
  const RandomMatrix matrix = random_matrix(n, 3, 31, 32);
  Cholesky cholesky{CholeskyAnalysis(matrix.lower)};
  ASSERT_TRUE(cholesky.factorize(matrix.lower));
  for (const int columns : {3, 48, 7, 1, 0}) {  // the workspaces grow and shrink
    const Eigen::MatrixXd right = TestRandom(33).matrix(n, columns);
    Eigen::MatrixXd solution = right;
    cholesky.solve(solution);
    ASSERT_EQ(solution.cols(), columns);
    EXPECT_LE((solution - solve_definite(matrix.dense, right)).norm(), kSolve * right.norm()) << columns;
  }
}

TEST(CholeskyReference, FactorsNewValuesOnTheSamePattern) {
  const int n = 90;
  Cholesky cholesky{CholeskyAnalysis(random_matrix(n, 4, 41, 42).lower)};
  for (unsigned seed = 43; seed < 47; ++seed) {
    const RandomMatrix matrix = random_matrix(n, 4, 41, seed);
    ASSERT_TRUE(cholesky.factorize(matrix.lower));
    const Eigen::VectorXd right = TestRandom(seed).vector(n);
    Eigen::VectorXd solution = right;
    cholesky.solve(solution);
    EXPECT_LE((matrix.dense * solution - right).norm(), kSolve * right.norm()) << seed;
  }
}

TEST(CholeskyReference, RefusesIndefiniteMatrices) {
  const int n = 60;
  const RandomMatrix good = random_matrix(n, 4, 51, 52);
  Cholesky cholesky{CholeskyAnalysis(good.lower)};
  // A negative first, middle or last pivot; a singular matrix; a NaN.
  for (const int pivot : {0, n / 2, n - 1}) {
    RandomMatrix bad = good;
    bad.lower.coeffRef(pivot, pivot) *= -1;
    EXPECT_FALSE(cholesky.factorize(bad.lower)) << pivot;
    ASSERT_TRUE(cholesky.factorize(good.lower)) << "a refusal must not stick";
  }
  RandomMatrix zero = good;
  zero.lower *= 0.0;
  EXPECT_FALSE(cholesky.factorize(zero.lower));
  ASSERT_TRUE(cholesky.factorize(good.lower));
  RandomMatrix not_a_number = good;
  not_a_number.lower.coeffRef(n / 2, n / 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(cholesky.factorize(not_a_number.lower));
  RandomMatrix barely = good;  // an eigenvalue just below zero, the diagonal still positive
  const double lowest = symmetric_modes(good.dense).values(0);
  for (int i = 0; i < n; ++i) barely.lower.coeffRef(i, i) -= lowest * (1 + 1e-6);
  EXPECT_FALSE(cholesky.factorize(barely.lower));

  ASSERT_TRUE(cholesky.factorize(good.lower));
  const Eigen::VectorXd right = TestRandom(53).vector(n);
  Eigen::VectorXd solution = right;
  cholesky.solve(solution);
  EXPECT_LE((good.dense * solution - right).norm(), kSolve * right.norm()) << "after refusals";
}

// Sylvester: a matrix shifted by s has as many negative eigenvalues as the matrix has eigenvalues below s.
TEST(CholeskyReference, AnIndefiniteMatrixIsSolvedAndItsNegativeEigenvaluesCounted) {
  for (const int n : {1, 17, 150}) {
    const RandomMatrix matrix = random_matrix(n, 4, 55, 56);
    const Eigen::VectorXd values = symmetric_modes(matrix.dense).values;
    Cholesky cholesky{CholeskyAnalysis(matrix.lower)};
    for (const int below : {0, 1, n / 2, n}) {
      SCOPED_TRACE(testing::Message() << below << " of " << n);
      const double shift = below == 0   ? 0.5 * values[0]
                           : below == n ? 1.5 * values[n - 1]
                                        : 0.5 * (values[below - 1] + values[below]);
      RandomMatrix shifted = matrix;
      shifted.dense.diagonal().array() -= shift;
      for (int i = 0; i < n; ++i) shifted.lower.coeffRef(i, i) -= shift;
      EXPECT_EQ(cholesky.factorize(shifted.lower), below == 0);
      ASSERT_TRUE(cholesky.factorize_indefinite(shifted.lower));
      EXPECT_EQ(cholesky.num_negative_pivots(), below);
      for (const int columns : {1, 5}) {
        const Eigen::MatrixXd right = TestRandom(57).matrix(n, columns);
        Eigen::MatrixXd solution = right;
        cholesky.solve(solution);
        // Fewer digits: no pivoting, and a shift half way between two eigenvalues.
        EXPECT_LE((shifted.dense * solution - right).norm(), 1e3 * kSolve * right.norm());
      }
    }
    ASSERT_TRUE(cholesky.factorize(matrix.lower));
    EXPECT_EQ(cholesky.num_negative_pivots(), 0) << "signs must not stick";
    Eigen::VectorXd solution = TestRandom(58).vector(n);
    const Eigen::VectorXd right = solution;
    cholesky.solve(solution);
    EXPECT_LE((matrix.dense * solution - right).norm(), kSolve * right.norm());
  }
  RandomMatrix singular = random_matrix(5, 0, 1, 2);
  singular.lower.coeffRef(3, 3) = 0;
  Cholesky cholesky{CholeskyAnalysis(singular.lower)};
  EXPECT_FALSE(cholesky.factorize_indefinite(singular.lower));
}

TEST(CholeskyReference, FactorsMadeAtOnceAreThoseMadeAlone) {
  // Large enough for METIS to cut the graph many times, each time with random choices.
  constexpr int kSize = 700;
  const RandomMatrix matrix = random_matrix(kSize, 2, 71, 72);
  const Eigen::VectorXd right = TestRandom(73).vector(kSize);
  const auto solve = [&] {
    Cholesky cholesky{CholeskyAnalysis(matrix.lower)};
    Eigen::VectorXd solution = right;
    if (cholesky.factorize(matrix.lower)) cholesky.solve(solution);
    return solution;
  };
  const Eigen::VectorXd alone = solve();
  std::array<Eigen::VectorXd, 4> at_once;
  std::vector<std::thread> threads;
  threads.reserve(at_once.size());
  for (Eigen::VectorXd& solution : at_once) threads.emplace_back([&] { solution = solve(); });
  for (std::thread& thread : threads) thread.join();
  for (const Eigen::VectorXd& solution : at_once) EXPECT_EQ(solution, alone) << "to the bit";
}

TEST(CholeskyReference, SinglePrecisionLeavesItsRounding) {
  // Above: condition (under 1e3) times single rounding. Below: single rounding, or the solve ran in double.
  constexpr double kSingle = 1e-4;
  const int n = 150;
  RandomMatrix matrix = random_matrix(n, 4, 21, 22);
  Cholesky cholesky{CholeskyAnalysis(matrix.lower)};
  for (const double unit : {1.0, 1e-60, 1e60}) {  // beyond the range of single precision
    SCOPED_TRACE(unit);
    RandomMatrix scaled = matrix;
    scaled.lower *= unit;
    ASSERT_TRUE(cholesky.factorize(scaled.lower, Precision::single_precision));
    for (const int columns : {1, 5}) {
      const Eigen::MatrixXd right = TestRandom(23).matrix(n, columns);
      Eigen::MatrixXd solution = right / unit;
      cholesky.solve(solution);
      const Eigen::MatrixXd expected = solve_definite(matrix.dense, right) / unit / unit;
      EXPECT_LE((solution - expected).norm(), kSingle * expected.norm());
      EXPECT_GE((solution - expected).norm(), 1e-9 * expected.norm());
    }
  }
  ASSERT_TRUE(cholesky.factorize(matrix.lower));
  Eigen::VectorXd solution = TestRandom(23).vector(n);
  const Eigen::VectorXd right = solution;
  cholesky.solve(solution);
  EXPECT_LE((matrix.dense * solution - right).norm(), kSolve * right.norm()) << "double after single";
}

TEST(CholeskyReference, AnyNumberOfThreadsGivesTheSameBits) {
  // A block with branches for the threads, and a dense matrix: a single front, cut into blocks.
  test::BlockShape shape;
  shape.cells = {6, 6, 12};
  const Model block = test::tetrahedral_block(shape);
  const Assembly assembly(block, test::no_dofs(block));
  SparseLower stiffness;
  assembly.tangent(Eigen::VectorXd::Zero(block.num_dofs()), false, stiffness);
  for (Eigen::Index equation = 0; equation < stiffness.cols(); ++equation)
    stiffness.coeffRef(equation, equation) *= 1.01;  // unsupported
  for (const SparseLower& matrix : {stiffness, random_matrix(1100, 20000, 81, 82).lower}) {
    const CholeskyAnalysis analysis(matrix);
    for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
      Cholesky alone(analysis, 1);
      ASSERT_TRUE(alone.factorize(matrix, precision));
      Eigen::VectorXd expected = TestRandom(83).vector(static_cast<int>(matrix.cols()));
      const Eigen::VectorXd right = expected;
      alone.solve(expected);
      const double residual = (matrix.selfadjointView<Eigen::Lower>() * expected - right).norm();
      EXPECT_LE(residual, (precision == Precision::double_precision ? 1e-12 : 1e-3) * right.norm());
      for (const int threads : {2, 3, 7}) {
        Cholesky shared(analysis, threads);
        ASSERT_TRUE(shared.factorize(matrix, precision));
        Eigen::VectorXd solution = right;
        shared.solve(solution);
        EXPECT_EQ(solution, expected) << threads << " threads, to the bit";
      }
    }
  }
}

// Two dense cliques of 1000 with 400 common unknowns: each front is cut into blocks and passes an update on.
SparseLower two_cliques() {
  constexpr int kSize = 1600;
  TestRandom random(91);
  std::vector<Eigen::Triplet<double>> entries;
  for (int column = 0; column < kSize; ++column) {
    entries.emplace_back(column, column, 900.0);
    for (int row = column + 1; row < kSize; ++row) {
      const bool together = row < 1000 || column >= 600;
      if (together) entries.emplace_back(row, column, random());
    }
  }
  SparseLower matrix(kSize, kSize);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

TEST(CholeskyReference, WideFrontsPassTheirUpdatesOn) {
  const SparseLower matrix = two_cliques();
  const CholeskyAnalysis analysis(matrix);
  const Eigen::VectorXd right = TestRandom(92).vector(static_cast<int>(matrix.cols()));
  Eigen::VectorXd alone;
  for (const int threads : {1, 2, 5}) {
    Cholesky cholesky(analysis, threads);
    ASSERT_TRUE(cholesky.factorize(matrix));
    Eigen::VectorXd solution = right;
    cholesky.solve(solution);
    EXPECT_LE((matrix.selfadjointView<Eigen::Lower>() * solution - right).norm(), kSolve * right.norm());
    if (threads == 1) alone = solution;
    EXPECT_EQ(solution, alone) << threads << " threads, to the bit";
  }
}

TEST(CholeskyReference, WideFrontsPassTheirSignedUpdatesOn) {
  SparseLower matrix = two_cliques();
  for (const int i : {3, 500, 700, 1200, 1599}) matrix.coeffRef(i, i) *= -1;
  const CholeskyAnalysis analysis(matrix);
  const Eigen::VectorXd right = TestRandom(92).vector(static_cast<int>(matrix.cols()));
  Eigen::VectorXd alone;
  for (const int threads : {1, 3}) {
    Cholesky cholesky(analysis, threads);
    ASSERT_TRUE(cholesky.factorize_indefinite(matrix));
    EXPECT_EQ(cholesky.num_negative_pivots(), 5) << "the matrix is dominated by its diagonal";
    Eigen::VectorXd solution = right;
    cholesky.solve(solution);
    EXPECT_LE((matrix.selfadjointView<Eigen::Lower>() * solution - right).norm(), kSolve * right.norm());
    if (threads == 1) alone = solution;
    EXPECT_EQ(solution, alone) << threads << " threads, to the bit";
  }
}

TEST(CholeskyReference, ThreadsRefuseAndGoOn) {
  // Disjoint blocks form a forest of elimination trees; the last block is not positive definite.
  constexpr int kBlocks = 40;
  constexpr int kRows = 30;
  const RandomMatrix block = random_matrix(kRows, 4, 93, 94);
  std::vector<Eigen::Triplet<double>> entries;
  for (int b = 0; b < kBlocks; ++b) {
    for (int column = 0; column < kRows; ++column) {
      for (SparseLower::InnerIterator it(block.lower, column); it; ++it)
        entries.emplace_back(kRows * b + static_cast<int>(it.row()), kRows * b + column, it.value());
    }
  }
  SparseLower good(kBlocks * kRows, kBlocks * kRows);
  good.setFromTriplets(entries.begin(), entries.end());
  SparseLower bad = good;
  bad.coeffRef(good.cols() - 1, good.cols() - 1) *= -1;
  const CholeskyAnalysis analysis(good);
  Cholesky cholesky(analysis, 4);
  for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
    EXPECT_FALSE(cholesky.factorize(bad, precision));
    ASSERT_TRUE(cholesky.factorize(good, precision));
    Eigen::VectorXd solution = TestRandom(95).vector(static_cast<int>(good.cols()));
    const Eigen::VectorXd right = solution;
    cholesky.solve(solution);
    EXPECT_LE((good.selfadjointView<Eigen::Lower>() * solution - right).norm(), 1e-3 * right.norm());
  }
}

TEST(CholeskyReference, NoEquationsAndNoFactor) {
  const SparseLower nothing(0, 0);
  Cholesky empty(CholeskyAnalysis(nothing), 3);
  ASSERT_TRUE(empty.factorize(nothing));
  Eigen::VectorXd none(0);
  empty.solve(none);
  Cholesky unused{CholeskyAnalysis(random_matrix(5, 2, 1, 2).lower)};
  Eigen::VectorXd right = Eigen::VectorXd::Ones(5);
  EXPECT_THROW(unused.solve(right), std::logic_error);
}

TEST(CholeskyReference, DoubleTellsABarelyIndefiniteMatrix) {
  // The 1D Laplacian, eigenvalues 2 - 2 cos(k pi / (n + 1)). A shift moves the smallest to 3e-8 of the
  // largest, below or above zero.
  constexpr int kSize = 3000;
  const double smallest = 2 - 2 * std::cos(std::acos(-1.0) / (kSize + 1));
  for (const double sign : {-1.0, 1.0}) {
    std::vector<Eigen::Triplet<double>> entries;
    for (int i = 0; i < kSize; ++i) {
      entries.emplace_back(i, i, 2 - smallest + sign * 4 * 3e-8);
      if (i > 0) entries.emplace_back(i, i - 1, -1.0);
    }
    SparseLower matrix(kSize, kSize);
    matrix.setFromTriplets(entries.begin(), entries.end());
    Cholesky cholesky{CholeskyAnalysis(matrix)};
    EXPECT_EQ(cholesky.factorize(matrix), sign > 0);
  }
}

TEST(CholeskyReference, CountsTheFactorsNonzeros) {
  const RandomMatrix diagonal = random_matrix(10, 0, 61, 62);
  EXPECT_EQ(CholeskyAnalysis(diagonal.lower).factor_nonzeros(), 10.0);
  const RandomMatrix matrix = random_matrix(80, 4, 63, 64);
  const CholeskyAnalysis larger(matrix.lower);
  EXPECT_GE(larger.factor_nonzeros(), static_cast<double>(matrix.lower.nonZeros()));
  EXPECT_LE(larger.factor_nonzeros(), 80.0 * 81 / 2);
  EXPECT_GT(larger.factor_operations(), larger.factor_nonzeros());
}

}  // namespace cholesky_test
}  // namespace palpate
