#include "offline/fem/conjugate_gradient.hpp"

namespace palpate {

void ConjugateGradient::prepare(const SparseLower& matrix) {
  matrix_ = matrix;
  preconditioner_.compute(matrix_);
}

bool ConjugateGradient::solve(Eigen::Ref<Eigen::VectorXd> right_hand_side) {
  constexpr double kTolerance = 1e-9;
  constexpr int kMaxIterations = 10000;
  const double target = kTolerance * right_hand_side.norm();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(right_hand_side.size());
  Eigen::VectorXd residual = right_hand_side;
  if (target == 0) return true;
  Eigen::VectorXd preconditioned = preconditioner_.solve(residual);
  Eigen::VectorXd direction = preconditioned;
  double slope = residual.dot(preconditioned);
  for (int i = 0; i < kMaxIterations; ++i) {
    const Eigen::VectorXd product = matrix_.selfadjointView<Eigen::Lower>() * direction;
    const double curvature = direction.dot(product);
    if (!(curvature > 0) || !(slope > 0)) return false;
    const double step = slope / curvature;
    x += step * direction;
    residual -= step * product;
    ++iterations_;
    if (residual.norm() <= target) {
      right_hand_side = x;
      return true;
    }
    preconditioned = preconditioner_.solve(residual);
    const double next_slope = residual.dot(preconditioned);
    direction = preconditioned + next_slope / slope * direction;
    slope = next_slope;
  }
  return false;
}

}  // namespace palpate
