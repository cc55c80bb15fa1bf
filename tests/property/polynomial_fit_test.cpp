// Least squares of values and derivatives returns a sampled polynomial.
#include <gtest/gtest.h>

#include "tests/support/polynomial_fit_fixture.hpp"

namespace palpate::polynomial_fit_fixture {
namespace polynomial_fit_test {

TEST(PolynomialFit, GivesBackThePolynomialThatWasSampled) {
  for (const int degree : {2, 3, 5, 7}) {
    const Synthetic truth(degree);
    for (const bool half : {false, true}) {
      SCOPED_TRACE(testing::Message() << degree << (half ? " half" : ""));
      const SitePolynomial fit = fit_polynomial(truth.samples(20, half), degree);
      EXPECT_EQ(fit.to_unit, any_map());
      EXPECT_EQ(fit.degree, degree);
      EXPECT_EQ(fit.basis_error, 0);
      EXPECT_EQ(fit.basis.rows(), kRows);
      ASSERT_EQ(fit.linear.cols(), 3);
      EXPECT_LE((fit.linear - truth.field.coefficients.leftCols<3>()).cwiseAbs().maxCoeff(), kDouble);
      ASSERT_EQ(fit.coefficients.rows(), num_terms(2, degree));
      EXPECT_LE((nonlinear_field(fit) - truth.field.coefficients.rightCols(num_terms(2, degree)))
                    .cwiseAbs()
                    .maxCoeff(),
                (half ? 10 : 1) * kDouble);
      ASSERT_EQ(fit.energy.size(), truth.energy.coefficients.cols());
      EXPECT_LE((fit.energy - truth.energy.coefficients.row(0).transpose()).cwiseAbs().maxCoeff(),
                (half ? 10 : 1) * kDouble);
    }
  }
}

// Coefficients of high degrees cancel, so the test compares functions.
TEST(PolynomialFit, TheHighestDegreeGivesBackTheFunction) {
  constexpr int kDegree = pack::kMaxDegree;
  ASSERT_EQ(highest_fit_degree(false), kDegree);
  EXPECT_LT(highest_fit_degree(true), kDegree);
  const Synthetic truth(kDegree);
  const SitePolynomial fit = fit_polynomial(truth.samples(120), kDegree);
  TestRandom random(85);
  for (int i = 0; i < 50; ++i) {
    Eigen::Vector3d x(random(), random(), random());
    if (x.norm() > 1) x.normalize();
    const Sample there = truth.at(x);
    EXPECT_LE((field_at(fit, there.displacement) - there.field).norm(), 1e-9 * there.field.norm());
    EXPECT_LE((force_at(fit, there.displacement) - there.force).norm(), 1e-9 * there.force.norm());
  }
}

// Without samples the fit is the linear response.
TEST(PolynomialFit, DegreeOneIsTheLinearResponse) {
  const Synthetic truth(1);
  const SitePolynomial fit = fit_polynomial(truth.samples(2), 1);
  EXPECT_EQ(fit.basis.cols(), 0);
  EXPECT_EQ(fit.coefficients.size(), 0);
  EXPECT_LE((fit.linear - truth.field.coefficients).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LE((fit.energy - truth.energy.coefficients.row(0).transpose()).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(PolynomialFit, LinearPartIsPinned) {
  // Samples of an unrelated function leave the prescribed linear part unchanged.
  constexpr int kDegree = 3;
  const Synthetic truth(kDegree);
  SiteSamples samples = truth.samples(12);
  for (Sample& sample : samples.samples) {
    sample.field *= 3;
    sample.field_tangent *= 3;
    sample.field_curvature *= 3;
    sample.energy *= 3;
    sample.force *= 3;
    sample.stiffness *= 3;
    sample.hardening *= 3;
  }
  const SitePolynomial fit = fit_polynomial(samples, kDegree);
  EXPECT_LE((fit.linear - truth.field.coefficients.leftCols<3>()).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LE((fit.energy.head<6>() - truth.energy.coefficients.row(0).head<6>().transpose()).norm(), 1e-14);
}

// Applies the fit's stated weights to the rows up to `order` of a system in x.
void weigh(int degree, int unweighed, Eigen::MatrixXd& rows) {
  for (Eigen::Index row = 0; row < rows.rows(); ++row) {
    const int order = row < 1 ? 0 : row < 4 ? 1 : row < 10 ? 2 : 3;
    rows.row(row) *= derivative_weight(degree, std::max(0, order - unweighed));
  }
}

// Samples outside the domain have lower weights, by the size of the fit's remainder there.
double weight_at(const Eigen::Vector3d& x, int degree) {
  return std::pow(std::max(x.norm(), 1.0), -degree) / std::max(x.norm(), 0.1);
}

// Samples of a higher degree than the fit's: the normal equations hold, so the fit minimises the weighted sum
// of squares.
TEST(PolynomialFit, TheResidualIsLeastSquares) {
  constexpr int kDegree = 3;
  SiteSamples samples = rough_samples(12, kDegree);
  add_beyond(kDegree, samples);
  const SitePolynomial fit = fit_polynomial(samples, kDegree);
  Polynomial truth = Synthetic(kDegree + 2).field;
  Polynomial energy = Synthetic(kDegree + 2).energy;
  truth.A.setIdentity();  // so derivatives in d are derivatives in x
  energy.A.setIdentity();
  Polynomial fitted = truth;
  fitted.coefficients.setZero();
  fitted.coefficients.leftCols<3>() = fit.linear;
  fitted.coefficients.middleCols(3, num_terms(2, kDegree)) = nonlinear_field(fit);
  Polynomial fitted_energy = energy;
  fitted_energy.coefficients.setZero();
  fitted_energy.coefficients.leftCols(fit.energy.size()) = fit.energy.transpose();

  Eigen::MatrixXd gradient = Eigen::MatrixXd::Zero(num_terms(2, kDegree), kRows);
  Eigen::MatrixXd energy_gradient = Eigen::MatrixXd::Zero(num_terms(3, kDegree + 1), 1);
  double misfit = 0;
  double energy_misfit = 0;
  for (const Sample& sample : samples.samples) {
    const Eigen::Vector3d x = samples.to_unit * sample.displacement;
    const auto rows_of = [&](const Polynomial& polynomial) {
      Eigen::MatrixXd rows(20, polynomial.coefficients.rows());
      rows.row(0) = polynomial.value(x).transpose();
      for (int i = 0; i < 3; ++i) rows.row(1 + i) = polynomial.slope(x, i).transpose();
      for (size_t ij = 0; ij < 6; ++ij) {
        rows.row(4 + static_cast<Eigen::Index>(ij)) =
            polynomial.curvature(x, kSecond[ij][0], kSecond[ij][1]).transpose();
      }
      for (size_t ijk = 0; ijk < 10; ++ijk) {
        rows.row(10 + static_cast<Eigen::Index>(ijk)) =
            polynomial.third(x, kThird[ijk][0], kThird[ijk][1], kThird[ijk][2]).transpose();
      }
      return rows;
    };
    Eigen::MatrixXd residual = (rows_of(truth) - rows_of(fitted)).topRows<10>();
    Eigen::MatrixXd design = hermite_rows(x, 2, kDegree, 2);
    residual *= weight_at(x, kDegree);
    design *= weight_at(x, kDegree);
    weigh(kDegree, 0, residual);
    weigh(kDegree, 0, design);
    gradient += design.transpose() * residual;
    misfit += residual.squaredNorm();

    Eigen::MatrixXd energy_residual = rows_of(energy) - rows_of(fitted_energy);
    Eigen::MatrixXd energy_design = hermite_rows(x, 3, kDegree + 1, 3);
    energy_residual *= weight_at(x, kDegree + 1);
    energy_design *= weight_at(x, kDegree + 1);
    weigh(kDegree, 1, energy_residual);
    weigh(kDegree, 1, energy_design);
    energy_gradient += energy_design.transpose() * energy_residual;
    energy_misfit += energy_residual.squaredNorm();
  }
  ASSERT_GT(misfit, 0.1) << "else this test shows nothing";
  EXPECT_LE(gradient.norm(), kDouble * std::sqrt(misfit));
  ASSERT_GT(energy_misfit, 0.1);
  EXPECT_LE(energy_gradient.norm(), kDouble * std::sqrt(energy_misfit));
}

TEST(PolynomialFit, TooFewSamplesAreRefused) {
  constexpr int kDegree = 3;
  const Synthetic truth(kDegree);
  EXPECT_THROW(fit_polynomial(truth.samples(1), kDegree), std::invalid_argument);
  EXPECT_EQ(held_out_error(truth.samples(1), kDegree).all, HUGE_VAL);
  // Many samples on a ray determine no polynomial off the ray.
  SiteSamples ray = truth.samples(0);
  for (int i = 1; i <= 20; ++i) ray.samples.push_back(truth.at(Eigen::Vector3d(0, 0, 0.05 * i)));
  EXPECT_THROW(fit_polynomial(ray, kDegree + 1), std::invalid_argument);
  EXPECT_EQ(held_out_error(ray, kDegree + 1).inside, HUGE_VAL);
}

TEST(PolynomialFit, FieldIsThatOfItsCoefficients) {
  TestRandom random(84);
  for (const int degree : {2, 5}) {
    const SitePolynomial fit = fit_polynomial(rough_samples(12, degree), degree);
    const SitePolynomial reduced = reduce_basis(fit, false, 0.1, true);
    for (int i = 0; i < 10; ++i) {
      const Eigen::Vector3d d = any_map().inverse() * random.vector() / 2;
      for (const SitePolynomial* polynomial : {&fit, &reduced}) {
        const Eigen::VectorXd expected = value_of(*polynomial, d);
        EXPECT_LE((field_at(*polynomial, d) - expected).norm(), 1e-13 * expected.norm());
      }
    }
  }
}

// ---- The design

TEST(PolynomialFitDesign, RowsAreValuesAndDerivatives) {
  // Central differences of degree 5 on the unit ball: truncation and rounding of 1e-10, times up to 60.
  constexpr double kStep = 1e-5;
  constexpr double kDifference = 1e-8;
  constexpr int kLast = 5;
  for (const Eigen::Vector3d& x :
       {Eigen::Vector3d(0.3, -0.7, 0.5), Eigen::Vector3d(0, 0.4, 0), Eigen::Vector3d(0, 0, 0)}) {
    for (const int first : {0, 2, 3}) {
      const Eigen::MatrixXd rows = hermite_rows(x, first, kLast, 3);
      ASSERT_EQ(rows.rows(), 20);
      ASSERT_EQ(rows.cols(), num_terms(first, kLast));
      for (int order = 0; order < 3; ++order) {
        const Eigen::MatrixXd fewer = hermite_rows(x, first, kLast, order);
        EXPECT_EQ(fewer, rows.topRows(num_terms(0, order)));
      }

      Eigen::VectorXd values(num_terms(0, kLast));
      pack::evaluate_monomials(x.data(), kLast, values.data());
      EXPECT_LE((rows.row(0).transpose() - values.tail(rows.cols())).cwiseAbs().maxCoeff(), 1e-15);

      for (int p = 0; p < 3; ++p) {
        const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(p);
        const Eigen::MatrixXd slope =
            (hermite_rows(x + step, first, kLast, 2) - hermite_rows(x - step, first, kLast, 2)) / (2 * kStep);
        // d/dx_p of a row is the row with one more factor x_p in the derivative.
        pack::for_each_monomial(2, [&](std::uint32_t row, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
          const std::uint32_t derivative = pack::monomial_index(a + (p == 0), b + (p == 1), c + (p == 2));
          EXPECT_LE((rows.row(derivative) - slope.row(row)).cwiseAbs().maxCoeff(), kDifference) << p << row;
        });
      }
    }
  }
}

}  // namespace polynomial_fit_test
}  // namespace palpate::polynomial_fit_fixture
