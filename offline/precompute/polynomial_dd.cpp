#include "offline/precompute/polynomial_dd.hpp"

#include <Eigen/QR>
#include <stdexcept>

#include "offline/precompute/hermite_design.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

Eigen::MatrixXd least_squares(const Eigen::MatrixXd& design, const Eigen::MatrixXd& values) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor(design);
  if (factor.rank() < design.cols())
    throw std::invalid_argument("the samples do not determine the polynomial");
  return factor.solve(values);
}

}  // namespace

SitePolynomial fit_polynomial(const std::vector<Sample>& samples, const SiteLinearResponse& linear,
                              double radius, int degree) {
  const auto count = static_cast<Eigen::Index>(samples.size());
  const Eigen::Index rows = linear.field.rows();
  SitePolynomial polynomial;
  polynomial.radius = radius;

  // Field: u(x) - r L x = sum over degrees 2 .. p; each sample gives it and its three derivatives.
  const auto field_terms = static_cast<Eigen::Index>(pack::num_monomials(1, static_cast<uint32_t>(degree)));
  polynomial.field.resize(rows, field_terms);
  polynomial.field.leftCols<3>() = radius * linear.field;
  if (degree > 1) {
    const double weight = derivative_weight(degree);
    Eigen::MatrixXd design(4 * count, field_terms - 3);
    Eigen::MatrixXd values(4 * count, rows);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Sample& sample = samples[static_cast<size_t>(i)];
      design.middleRows<4>(4 * i) = hermite_rows(sample.displacement / radius, 2, degree);
      values.row(4 * i) = (sample.field - linear.field * sample.displacement).transpose();
      values.middleRows<3>(4 * i + 1) = weight * radius * (sample.field_tangent - linear.field).transpose();
      design.middleRows<3>(4 * i + 1) *= weight;
    }
    polynomial.field.rightCols(field_terms - 3) = least_squares(design, values).transpose();
  }

  // Energy: E(x) - r^2/2 x S x = sum over degrees 3 .. p + 1, known with gradient r f and Hessian r^2 S(d).
  // The force is what is wanted, so the weights count from the gradient.
  const double weight = derivative_weight(degree);
  const double square = radius * radius;
  const Eigen::Matrix3d& S = linear.stiffness;
  Eigen::MatrixXd design(
      10 * count, static_cast<Eigen::Index>(pack::num_monomials(3, static_cast<uint32_t>(degree) + 1)));
  Eigen::VectorXd values(10 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Sample& sample = samples[static_cast<size_t>(i)];
    design.middleRows<10>(10 * i) = hermite_rows_second_order(sample.displacement / radius, 3, degree + 1);
    values[10 * i] = sample.energy - 0.5 * sample.displacement.dot(S * sample.displacement);
    values.segment<3>(10 * i + 1) = radius * (sample.force - S * sample.displacement);
    const Eigen::Matrix3d excess = square * (sample.stiffness - S);
    values.segment<6>(10 * i + 4) << excess(0, 0), excess(0, 1), excess(0, 2), excess(1, 1), excess(1, 2),
        excess(2, 2);
    design.middleRows<6>(10 * i + 4) *= weight;
    values.segment<6>(10 * i + 4) *= weight;
  }
  polynomial.energy.resize(6 + design.cols());
  polynomial.energy.head<6>() << 0.5 * S(0, 0), S(0, 1), S(0, 2), 0.5 * S(1, 1), S(1, 2), 0.5 * S(2, 2);
  polynomial.energy.head<6>() *= square;
  polynomial.energy.tail(design.cols()) = least_squares(design, values);
  return polynomial;
}

}  // namespace palpate
