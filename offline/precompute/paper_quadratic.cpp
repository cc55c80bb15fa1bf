#include "offline/precompute/paper_quadratic.hpp"

#include <Eigen/LU>

#include "offline/numerics/decompositions.hpp"
#include "offline/precompute/hermite_design.hpp"

namespace palpate {

std::vector<Eigen::Vector3d> grid_points(bool half) {
  std::vector<Eigen::Vector3d> points;
  for (const double x : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    for (const double y : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
      for (const double z : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
        const Eigen::Vector3d point(x, y, z);
        const bool inside = point.norm() > 0 && point.norm() <= 1;
        if (inside && (!half || z >= 0)) points.push_back(point);
      }
    }
  }
  return points;
}

std::vector<Eigen::Vector3d> ray_points(const Eigen::Vector3d& end) {
  constexpr int kPoints = 10;
  std::vector<Eigen::Vector3d> points;
  for (int i = 1; i <= kPoints; ++i) points.push_back(end * i / kPoints);
  return points;
}

SitePolynomial fit_paper_quadratic(const SiteSamples& samples) {
  const auto count = static_cast<Eigen::Index>(samples.samples.size());
  const Eigen::Matrix3d from_unit = samples.to_unit.inverse();
  Eigen::MatrixXd field_design(count, 9);
  Eigen::MatrixXd fields(count, samples.linear.field.rows());
  Eigen::MatrixXd energy_design(4 * count, 16);
  Eigen::VectorXd energies(4 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Sample& sample = samples.samples[static_cast<size_t>(i)];
    const Eigen::Vector3d x = samples.to_unit * sample.displacement;
    field_design.row(i) = hermite_rows(x, 1, 2, 0);
    fields.row(i) = sample.field.transpose();
    energy_design.middleRows<4>(4 * i) = hermite_rows(x, 2, 3, 1);
    energies[4 * i] = sample.energy;
    energies.segment<3>(4 * i + 1) = from_unit.transpose() * sample.force;
  }
  const Eigen::MatrixXd field = least_squares(field_design, fields).transpose();
  SitePolynomial polynomial;
  polynomial.to_unit = samples.to_unit;
  polynomial.degree = 2;
  polynomial.linear = field.leftCols<3>();
  polynomial.basis = field.rightCols<6>();
  polynomial.coefficients = Eigen::MatrixXd::Identity(6, 6);
  polynomial.energy = least_squares(energy_design, energies);
  return polynomial;
}

}  // namespace palpate
