#include "offline/precompute/force_derivatives.hpp"

#include <algorithm>

namespace palpate {
namespace {

using Values = Eigen::Map<Eigen::VectorXd>;

Values values_of(SparseLower& matrix) {
  return {matrix.valuePtr(), matrix.nonZeros()};
}

size_t place_of(int a, int b) {
  const int high = std::max(a, b);
  return static_cast<size_t>(high * (high + 1) / 2 + std::min(a, b));
}

}  // namespace

ForceDerivatives::ForceDerivatives(const Assembly& assembly, const Eigen::VectorXd& at_rest,
                                   const Eigen::MatrixXd& fields, double step, bool to_third_order)
    : assembly_(&assembly) {
  SparseLower resting;
  SparseLower behind;
  if (to_third_order) assembly.tangent(at_rest, false, resting);
  // Central difference: (K(+) + K(-)) / 2 - K(rest), times 2 / step^2, is n3(u, u, .).
  const auto step_along = [&](const Eigen::VectorXd& u, SparseLower& ahead) {
    assembly.tangent(at_rest + step * u, false, ahead);
    assembly.tangent(at_rest - step * u, false, behind);
  };
  const auto curvature = [&](SparseLower& ahead) {
    return (values_of(ahead) + values_of(behind) - 2 * values_of(resting)) / (step * step);
  };
  for (int a = 0; a < 3; ++a) {
    SparseLower& ahead = second_[static_cast<size_t>(a)];
    step_along(fields.col(a), ahead);
    if (to_third_order) {
      SparseLower& third = third_[place_of(a, a)];
      third = ahead;
      values_of(third) = curvature(ahead);
    }
    values_of(ahead) = (values_of(ahead) - values_of(behind)).eval() / (2 * step);
  }
  for (int a = 0; a < 3 && to_third_order; ++a) {
    for (int b = 0; b < a; ++b) {
      // n3(u_a + u_b, u_a + u_b, .) contains the mixed term twice.
      SparseLower& ahead = third_[place_of(a, b)];
      step_along(fields.col(a) + fields.col(b), ahead);
      values_of(ahead) =
          0.5 *
          (curvature(ahead) - values_of(third_[place_of(a, a)]) - values_of(third_[place_of(b, b)])).eval();
    }
  }
}

Eigen::MatrixXd ForceDerivatives::second(int a, const Eigen::MatrixXd& v) const {
  return times(second_[static_cast<size_t>(a)], v);
}

Eigen::MatrixXd ForceDerivatives::third(int a, int b, const Eigen::MatrixXd& v) const {
  return times(third_[place_of(a, b)], v);
}

// Processes eight columns at a time, stored row by row.
Eigen::MatrixXd ForceDerivatives::times(const SparseLower& matrix, const Eigen::MatrixXd& v) const {
  constexpr Eigen::Index kWidth = 8;
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, kWidth, Eigen::RowMajor>;
  const auto num_equations = static_cast<Eigen::Index>(assembly_->num_equations());
  const std::vector<int>& dofs = assembly_->equation_dofs();
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(v.rows(), v.cols());
  Rows from(num_equations, kWidth);
  Rows to(num_equations, kWidth);
  for (Eigen::Index first = 0; first < v.cols(); first += kWidth) {
    const Eigen::Index width = std::min(kWidth, v.cols() - first);
    from.setZero();
    to.setZero();
    for (Eigen::Index k = 0; k < width; ++k) from.col(k) = v(dofs, first + k);
    for (Eigen::Index column = 0; column < num_equations; ++column) {
      Eigen::Matrix<double, 1, kWidth> sum = Eigen::Matrix<double, 1, kWidth>::Zero();
      for (SparseLower::InnerIterator entry(matrix, static_cast<SparseLower::StorageIndex>(column)); entry;
           ++entry) {
        sum += entry.value() * from.row(entry.row());
        if (entry.row() != column) to.row(entry.row()) += entry.value() * from.row(column);
      }
      to.row(column) += sum;
    }
    for (Eigen::Index k = 0; k < width; ++k) product(dofs, first + k) = to.col(k);
  }
  return product;
}

}  // namespace palpate
