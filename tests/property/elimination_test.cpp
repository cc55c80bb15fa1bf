// Elimination of the first unknowns of a dense symmetric matrix, compared with Eigen.
#include "runtime/src/numerics/elimination.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "offline/pack/pack_writer.hpp"

namespace palpate {
namespace elimination_test {

std::vector<EliminationKernel> kernels() {
  EliminationKernel listed[kMostEliminationKernels];
  const uint32_t count = list_elimination_kernels(listed);
  return {listed, listed + count};
}

Eigen::MatrixXd positive_definite(Eigen::Index size) {
  std::srand(7);
  const Eigen::MatrixXd any = Eigen::MatrixXd::Random(size, size);
  return any * any.transpose() + 0.1 * static_cast<double>(size) * Eigen::MatrixXd::Identity(size, size);
}

// Numbers aligned to a cache line, as in the arena.
template <typename Number>
struct OnCacheLines {
  using Matrix = Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic>;
  OnCacheLines(Eigen::Index rows, Eigen::Index columns)
      : memory(static_cast<size_t>(rows * columns) * sizeof(Number)),
        numbers(reinterpret_cast<Number*>(memory.bytes().data()), rows, columns) {}
  AlignedBytes memory;
  Eigen::Map<Matrix> numbers;
};
using Vectors = OnCacheLines<double>;
using Floats = OnCacheLines<float>;

// The kernels' matrix layout, with nonsense in the upper triangle.
struct Stored : Floats {
  explicit Stored(const Eigen::MatrixXd& matrix)
      : Floats(elimination_stride(static_cast<uint32_t>(matrix.rows())),
               round_to_columns(static_cast<uint32_t>(matrix.rows())) + kEliminationColumns),
        size(static_cast<uint32_t>(matrix.rows())),
        stride(elimination_stride(size)) {
    numbers.setConstant(1e3F);
    for (Eigen::Index column = 0; column < matrix.cols(); ++column)
      numbers.col(column).segment(column, size - column) =
          matrix.col(column).tail(size - column).cast<float>();
  }
  Eigen::MatrixXd lower() const {
    return numbers.topLeftCorner(size, size).cast<double>().triangularView<Eigen::Lower>();
  }
  uint32_t size;
  uint32_t stride;
};

constexpr uint32_t kSizes[][2] = {{4, 5}, {8, 9}, {12, 16}, {28, 35}, {60, 64}, {124, 131}};

TEST(Elimination, LeavesTheFactorAndTheCondensedMatrix) {
  for (const EliminationKernel& kernel : kernels()) {
    for (const auto& [eliminated, size] : kSizes) {
      SCOPED_TRACE(testing::Message() << kernel.name << " " << eliminated << " of " << size);
      const Eigen::MatrixXd matrix = positive_definite(size);
      Stored stored(matrix);
      ASSERT_TRUE(eliminate(kernel, stored.numbers.data(), stored.stride, size, eliminated));
      const auto e = static_cast<Eigen::Index>(eliminated);
      const auto left = static_cast<Eigen::Index>(size) - e;
      const Eigen::MatrixXd L = matrix.topLeftCorner(e, e).llt().matrixL();
      const Eigen::MatrixXd X =
          L.triangularView<Eigen::Lower>().solve(matrix.topRightCorner(e, left)).transpose();
      const Eigen::MatrixXd condensed = matrix.bottomRightCorner(left, left) - X * X.transpose();
      const double tolerance = 1e-6 * matrix.norm();
      const Eigen::MatrixXd found = stored.lower();
      EXPECT_LE((found.topLeftCorner(e, e) - L).norm(), tolerance);
      EXPECT_LE((found.bottomLeftCorner(left, e) - X).norm(), tolerance);
      const Eigen::MatrixXd lower = condensed.triangularView<Eigen::Lower>();
      EXPECT_LE((found.bottomRightCorner(left, left) - lower).norm(), tolerance);
    }
  }
}

TEST(Elimination, BackSubstitutesRows) {
  for (const EliminationKernel& kernel : kernels()) {
    for (const uint32_t count : {1u, 3u, 4u, 7u}) {
      constexpr uint32_t kSize = 60;
      SCOPED_TRACE(testing::Message() << kernel.name << " " << count);
      Stored stored(positive_definite(kSize));
      ASSERT_TRUE(eliminate(kernel, stored.numbers.data(), stored.stride, kSize, kSize));
      const Eigen::MatrixXd L = stored.lower();
      const Eigen::MatrixXd rows = Eigen::MatrixXd::Random(kSize, count);
      Vectors found(kSize, count);
      found.numbers = rows;
      kernel.back_substitute(stored.numbers.data(), stored.stride, kSize, found.numbers.data(), kSize, count);
      EXPECT_LE((L.transpose() * found.numbers - rows).norm(), 1e-12 * rows.norm());
    }
  }
}

TEST(Elimination, SubstitutesForward) {
  for (const EliminationKernel& kernel : kernels()) {
    SCOPED_TRACE(kernel.name);
    constexpr uint32_t kSize = 60;
    Stored stored(positive_definite(kSize));
    ASSERT_TRUE(eliminate(kernel, stored.numbers.data(), stored.stride, kSize, kSize));
    const Eigen::MatrixXd L = stored.lower();
    Vectors found(kSize, 1);
    found.numbers.setRandom();
    const Eigen::MatrixXd given = found.numbers;
    kernel.forward_substitute(stored.numbers.data(), stored.stride, kSize, found.numbers.data());
    EXPECT_LE((L * found.numbers - given).norm(), 1e-12 * given.norm());
  }
}

// Also rows of half a register, and columns that begin on 16 bytes.
TEST(Elimination, AddsProducts) {
  for (const EliminationKernel& kernel : kernels()) {
    for (const Eigen::Index rows : {8, 36, 48, 56, 72}) {
      SCOPED_TRACE(testing::Message() << kernel.name << " " << rows);
      constexpr Eigen::Index kColumns = 27;
      const Eigen::MatrixXf matrix = Eigen::MatrixXf::Random(rows, kColumns);
      Vectors memory(rows, kColumns);
      float* columns = reinterpret_cast<float*>(memory.numbers.data()) + 4;
      Eigen::Map<Eigen::MatrixXf>(columns, rows, kColumns) = matrix;
      Vectors x(kColumns, 1);
      Vectors y(rows, 1);
      x.numbers.setRandom();
      y.numbers.setRandom();
      const Eigen::MatrixXd expected = y.numbers + matrix.cast<double>() * x.numbers;
      const auto count = static_cast<uint32_t>(rows);
      kernel.add_product(columns, count, count, kColumns, x.numbers.data(), y.numbers.data());
      EXPECT_LE((y.numbers - expected).norm(), 1e-12 * expected.norm());
    }
  }
}

TEST(Elimination, AddsTransposedProducts) {
  for (const EliminationKernel& kernel : kernels()) {
    for (const Eigen::Index rows : {8, 24, 64}) {
      for (const Eigen::Index count : {4, 16, 40}) {
        SCOPED_TRACE(testing::Message() << kernel.name << " " << rows << " x " << count);
        AlignedBytes memory(static_cast<size_t>(rows * count) * sizeof(float));
        Eigen::Map<Eigen::MatrixXf> matrix(reinterpret_cast<float*>(memory.bytes().data()), rows, count);
        Vectors x(rows, 1);
        Vectors y(count, 1);
        matrix.setRandom();
        x.numbers.setRandom();
        y.numbers.setRandom();
        const Eigen::MatrixXd expected = y.numbers + matrix.cast<double>().transpose() * x.numbers;
        kernel.add_transposed_product(matrix.data(), static_cast<uint32_t>(rows), static_cast<uint32_t>(rows),
                                      static_cast<uint32_t>(count), x.numbers.data(), y.numbers.data());
        EXPECT_LE((y.numbers - expected).norm(), 1e-12 * expected.norm());
      }
    }
  }
}

TEST(Elimination, AddsSymmetricProducts) {
  for (const EliminationKernel& kernel : kernels()) {
    for (const Eigen::Index rows : {8, 16, 40, 72}) {
      SCOPED_TRACE(testing::Message() << kernel.name << " " << rows);
      Floats matrix(rows, rows);
      Vectors x(rows, 1);
      Vectors y(rows, 1);
      matrix.numbers.setRandom();
      matrix.numbers = (matrix.numbers + matrix.numbers.transpose()).eval();
      x.numbers.setRandom();
      y.numbers.setRandom();
      const Eigen::MatrixXd expected = y.numbers + matrix.numbers.cast<double>() * x.numbers;
      kernel.add_symmetric_product(matrix.numbers.data(), static_cast<uint32_t>(rows), x.numbers.data(),
                                   y.numbers.data());
      EXPECT_LE((y.numbers - expected).norm(), 1e-12 * expected.norm());
    }
  }
}

TEST(Elimination, RefusesIndefiniteMatrices) {
  for (const EliminationKernel& kernel : kernels()) {
    SCOPED_TRACE(kernel.name);
    for (const double wrong : {-1.0, 0.0, std::nan(""), HUGE_VAL}) {
      Eigen::MatrixXd matrix = positive_definite(20);
      matrix.row(9).setZero();
      matrix.col(9).setZero();
      matrix(9, 9) = wrong;
      Stored stored(matrix);
      EXPECT_FALSE(eliminate(kernel, stored.numbers.data(), stored.stride, 20, 20)) << wrong;
      // An unknown that stays has no pivot.
      Eigen::MatrixXd last = positive_definite(20);
      last(19, 19) = -1;
      Stored staying(last);
      EXPECT_TRUE(eliminate(kernel, staying.numbers.data(), staying.stride, 20, 16));
    }
  }
}

}  // namespace elimination_test
}  // namespace palpate
