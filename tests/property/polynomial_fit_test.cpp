// Least squares of values and derivatives: a polynomial that was sampled comes back.
#include "offline/precompute/polynomial_dd.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "offline/precompute/ball_polynomials.hpp"
#include "offline/precompute/degree_choice.hpp"
#include "offline/precompute/hermite_design.hpp"
#include "schemas/monomials.hpp"
#include "schemas/pack_layout.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace {

using test::TestRandom;

constexpr Eigen::Index kRows = 12;
// Rounding times the condition of the design, some hundred, and what turns orthonormal polynomials into monomials.
constexpr double kDouble = 1e-11;

Eigen::Index num_terms(int first, int last) {
  return pack::num_monomials(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last));
}

// A map of an ellipsoid with axes of 1.3 to 3.3, askew to all axes.
Eigen::Matrix3d any_map() {
  Eigen::Matrix3d A;
  A << 0.45, 0.10, -0.05, -0.12, 0.60, 0.08, 0.02, 0.15, 0.38;
  return A;
}

// Coefficients of a polynomial in x = A d from degree `first` on, and its derivatives.
struct Polynomial {
  int first;
  int last;
  Eigen::MatrixXd coefficients;  // rows x monomials
  Eigen::Matrix3d A = any_map();

  Eigen::VectorXd value(const Eigen::Vector3d& x) const { return by_x(x, {0, 0, 0}); }

  // By d_i, d_i d_j, d_i d_j d_k: the chain rule, written out.
  Eigen::VectorXd slope(const Eigen::Vector3d& x, int i) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(coefficients.rows());
    for (int p = 0; p < 3; ++p) sum += A(p, i) * by_x(x, times({p}));
    return sum;
  }
  Eigen::VectorXd curvature(const Eigen::Vector3d& x, int i, int j) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(coefficients.rows());
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) sum += A(p, i) * A(q, j) * by_x(x, times({p, q}));
    }
    return sum;
  }
  Eigen::VectorXd third(const Eigen::Vector3d& x, int i, int j, int k) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(coefficients.rows());
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) {
        for (int r = 0; r < 3; ++r) sum += A(p, i) * A(q, j) * A(r, k) * by_x(x, times({p, q, r}));
      }
    }
    return sum;
  }

 private:
  // How often by each axis.
  static std::array<int, 3> times(std::initializer_list<int> axes) {
    std::array<int, 3> orders = {};
    for (const int axis : axes) ++orders[static_cast<size_t>(axis)];
    return orders;
  }
  Eigen::VectorXd by_x(const Eigen::Vector3d& x, const std::array<int, 3>& orders) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(coefficients.rows());
    Eigen::Index column = 0;
    pack::for_each_monomial(static_cast<std::uint32_t>(last), [&](std::uint32_t, std::uint32_t a,
                                                                  std::uint32_t b, std::uint32_t c) {
      if (static_cast<int>(a + b + c) < first) return;
      sum += coefficients.col(column++) * one(x[0], static_cast<int>(a), orders[0]) *
             one(x[1], static_cast<int>(b), orders[1]) * one(x[2], static_cast<int>(c), orders[2]);
    });
    return sum;
  }
  static double one(double x, int power, int order) {
    if (order > power) return 0;
    double value = 1;
    for (int i = 0; i < order; ++i) value *= power - i;
    for (int i = order; i < power; ++i) value *= x;
    return value;
  }
};

constexpr std::array<std::array<int, 2>, 6> kSecond = {{{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};
constexpr std::array<std::array<int, 3>, 10> kThird = {{{0, 0, 0},
                                                        {0, 0, 1},
                                                        {0, 0, 2},
                                                        {0, 1, 1},
                                                        {0, 1, 2},
                                                        {0, 2, 2},
                                                        {1, 1, 1},
                                                        {1, 1, 2},
                                                        {1, 2, 2},
                                                        {2, 2, 2}}};

// Samples of a field and an energy that are polynomials. They need not belong together.
struct Synthetic {
  // Of the degree that is to be fitted.
  explicit Synthetic(int degree)
      : field{1, degree, TestRandom(81).matrix(kRows, num_terms(1, degree))},
        energy{2, degree + 1, TestRandom(82).matrix(1, num_terms(2, degree + 1))} {}

  Polynomial field;
  Polynomial energy;

  SiteLinearResponse linear() const {
    const Eigen::Matrix3d A = any_map();
    SiteLinearResponse response;
    response.field = field.coefficients.leftCols<3>() * A;
    const auto e = energy.coefficients.row(0);
    response.stiffness << 2 * e[0], e[1], e[2], e[1], 2 * e[3], e[4], e[2], e[4], 2 * e[5];
    response.stiffness = A.transpose() * response.stiffness * A;
    return response;
  }

  Sample at(const Eigen::Vector3d& x) const {
    Sample sample;
    sample.displacement = any_map().inverse() * x;
    sample.field = field.value(x);
    sample.field_tangent.resize(kRows, 3);
    sample.field_curvature.resize(kRows, 6);
    sample.energy = energy.value(x)[0];
    for (int i = 0; i < 3; ++i) {
      sample.field_tangent.col(i) = field.slope(x, i);
      sample.force[i] = energy.slope(x, i)[0];
      for (int j = 0; j < 3; ++j) sample.stiffness(i, j) = energy.curvature(x, i, j)[0];
    }
    for (size_t ij = 0; ij < 6; ++ij)
      sample.field_curvature.col(static_cast<Eigen::Index>(ij)) =
          field.curvature(x, kSecond[ij][0], kSecond[ij][1]);
    for (size_t ijk = 0; ijk < 10; ++ijk) {
      sample.hardening[static_cast<Eigen::Index>(ijk)] =
          energy.third(x, kThird[ijk][0], kThird[ijk][1], kThird[ijk][2])[0];
    }
    return sample;
  }

  SiteSamples samples(size_t count, bool half = false) const {
    SamplePoints points(half);
    SiteSamples result;
    for (size_t i = 0; i < count; ++i) result.samples.push_back(at(points[i]));
    result.linear = linear();
    result.to_unit = any_map();
    result.half = half;
    return result;
  }
};

// Samples of what is of `more` degrees more than is fitted.
SiteSamples rough_samples(size_t count, int degree, bool half = false) {
  Synthetic truth(degree + 2);
  return truth.samples(count, half);
}

// Coefficients of the nonlinear field: 3 packed nodes x monomials of degree 2 .. degree.
Eigen::MatrixXd nonlinear_field(const SitePolynomial& polynomial) {
  return polynomial.basis * polynomial.coefficients.transpose();
}

// The field, from its coefficients multiplied out.
Eigen::VectorXd value_of(const SitePolynomial& polynomial, const Eigen::Vector3d& d) {
  const Eigen::Vector3d x = polynomial.to_unit * d;
  Eigen::VectorXd field = polynomial.linear * x;
  if (polynomial.basis.cols() > 0)
    field += nonlinear_field(polynomial) * hermite_rows(x, 2, polynomial.degree, 0).transpose();
  return field;
}

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

// Coefficients of high degrees cancel: what comes back is the function.
TEST(PolynomialFit, OfTheHighestDegreeGivesBackTheFunction) {
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

// No samples tell more than the linear answer: that is what is packed.
TEST(PolynomialFit, OfDegreeOneIsTheLinearAnswer) {
  const Synthetic truth(1);
  const SitePolynomial fit = fit_polynomial(truth.samples(2), 1);
  EXPECT_EQ(fit.basis.cols(), 0);
  EXPECT_EQ(fit.coefficients.size(), 0);
  EXPECT_LE((fit.linear - truth.field.coefficients).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LE((fit.energy - truth.energy.coefficients.row(0).transpose()).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(PolynomialFit, LinearPartIsPinned) {
  // Samples of something else entirely: the linear part still is what it was told.
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

// Weighs rows up to `order` of a system in x as the fit is said to.
void weigh(int degree, int unweighed, Eigen::MatrixXd& rows) {
  for (Eigen::Index row = 0; row < rows.rows(); ++row) {
    const int order = row < 1 ? 0 : row < 4 ? 1 : row < 10 ? 2 : 3;
    rows.row(row) *= derivative_weight(degree, std::max(0, order - unweighed));
  }
}

// Beyond the domain a sample counts less, by what a fit leaves there.
double weight_at(const Eigen::Vector3d& x, int degree) {
  return std::pow(std::max(x.norm(), 1.0), -degree) / std::max(x.norm(), 0.1);
}

// Three more samples, beyond the domain.
void add_beyond(int degree, SiteSamples& samples) {
  for (const Eigen::Vector3d& x :
       {Eigen::Vector3d(1.3, 0, 0), Eigen::Vector3d(0, -0.9, 0.9), Eigen::Vector3d(1, 1, 1)})
    samples.samples.push_back(Synthetic(degree + 2).at(x));
}

// Samples of more degrees than are fitted: the normal equations hold, so that no other polynomial of the degree is
// nearer in the weighted sum of squares.
TEST(PolynomialFit, WhatItLeavesOutIsLeastSquares) {
  constexpr int kDegree = 3;
  SiteSamples samples = rough_samples(12, kDegree);
  add_beyond(kDegree, samples);
  const SitePolynomial fit = fit_polynomial(samples, kDegree);
  Polynomial truth = Synthetic(kDegree + 2).field;
  Polynomial energy = Synthetic(kDegree + 2).energy;
  truth.A.setIdentity();  // derivatives by x
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
  // Many on one ray are no better: they know nothing off it.
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

// ---- The error at samples left out

// Of those samples with |A d| up to `within`.
double error_by_refits(const SiteSamples& samples, int degree, double within = 1.1) {
  double squares = 0;
  int pushes = 0;
  for (size_t i = 0; i < samples.samples.size(); ++i) {
    SiteSamples others = samples;
    others.samples.erase(others.samples.begin() + static_cast<std::ptrdiff_t>(i));
    const Sample& left_out = samples.samples[i];
    if ((samples.to_unit * left_out.displacement).norm() > within) continue;
    ++pushes;
    const Eigen::VectorXd error =
        value_of(fit_polynomial(others, degree), left_out.displacement) - left_out.field;
    const double part = largest_node(error) / left_out.displacement.norm();
    squares += part * part;
  }
  return std::sqrt(squares / pushes);
}

TEST(PolynomialFit, HeldOutErrorIsThatOfRefitsWithoutEachSample) {
  for (const bool half : {false, true}) {
    for (const int degree : {2, 3, 4}) {
      SCOPED_TRACE(testing::Message() << degree << (half ? " half" : ""));
      const SiteSamples samples = rough_samples(12, degree, half);
      const double expected = error_by_refits(samples, degree);
      const HeldOutError error = held_out_error(samples, degree);
      EXPECT_NEAR(error.all, expected, 1e-8 * expected);
      EXPECT_EQ(error.inside, error.all) << "none of so few lies inside";
      // Another number than that of the fit to all samples.
      const SitePolynomial fit = fit_polynomial(samples, degree);
      double squares = 0;
      for (const Sample& sample : samples.samples) {
        const double part =
            largest_node(value_of(fit, sample.displacement) - sample.field) / sample.displacement.norm();
        squares += part * part;
      }
      EXPECT_LT(std::sqrt(squares / 12), 0.9 * expected);
    }
  }
}

// Of many samples every third lies inside.
TEST(PolynomialFit, HeldOutErrorInsideIsThatOfRefitsThere) {
  const SiteSamples samples = rough_samples(24, 4);
  const HeldOutError error = held_out_error(samples, 4);
  const double expected = error_by_refits(samples, 4, 0.9);
  EXPECT_NEAR(error.inside, expected, 1e-8 * expected);
  EXPECT_LT(error.inside, 0.9 * error.all);
}

// Samples beyond it are fitted to, and are no measure of it.
TEST(PolynomialFit, HeldOutErrorsAreOfTheDomain) {
  constexpr int kDegree = 3;
  SiteSamples samples = rough_samples(16, kDegree);
  add_beyond(kDegree, samples);
  const double expected = error_by_refits(samples, kDegree, 1.1);
  EXPECT_NEAR(held_out_error(samples, kDegree).all, expected, 1e-8 * expected);
  EXPECT_GT(error_by_refits(samples, kDegree, 2), 1.1 * expected) << "else this test shows nothing";
  double largest = 0;
  for (size_t i = 0; i < 16; ++i) largest = std::max(largest, samples.samples[i].force.norm());
  EXPECT_EQ(force_floor(samples), 0.05 * largest);
  SiteSamples none = samples;
  none.to_unit *= 1e3;
  EXPECT_EQ(held_out_error(none, kDegree).all, HUGE_VAL) << "no sample is in that domain";
}

// Of the force, the gradient of the fitted energy.
TEST(PolynomialFit, HeldOutForceErrorIsThatOfRefits) {
  for (const int degree : {2, 4}) {
    const SiteSamples samples = rough_samples(12, degree);
    double largest = 0;
    for (const Sample& sample : samples.samples) largest = std::max(largest, sample.force.norm());
    double squares = 0;
    for (size_t i = 0; i < samples.samples.size(); ++i) {
      SiteSamples others = samples;
      others.samples.erase(others.samples.begin() + static_cast<std::ptrdiff_t>(i));
      const Sample& left_out = samples.samples[i];
      const SitePolynomial fit = fit_polynomial(others, degree);
      const Eigen::Vector3d x = fit.to_unit * left_out.displacement;
      const Eigen::Vector3d force =
          fit.to_unit.transpose() * (hermite_rows(x, 2, degree + 1, 1).bottomRows<3>() * fit.energy);
      const double part = (force - left_out.force).norm() / std::max(left_out.force.norm(), 0.05 * largest);
      squares += part * part;
    }
    const double expected = std::sqrt(squares / 12);
    EXPECT_GT(expected, 1e-3);
    EXPECT_NEAR(held_out_force_error(samples, degree).all, expected, 1e-8 * expected) << degree;
  }
}

// A function of degree 9: the usual degrees, to 7, do not hold it, and of the higher ones 9 is the first that does.
TEST(PolynomialFit, DegreesAreRaisedToWhatAFunctionIs) {
  const SiteSamples samples = Synthetic(9).samples(60);
  const DegreeChoice usual = choose_degree(samples);
  EXPECT_LE(usual.degree, 7);
  EXPECT_GT(usual.error, 1e-6);
  EXPECT_NEAR(usual.error, held_out_error(samples, usual.degree).all, 1e-12 * usual.error);
  EXPECT_EQ(usual.force_error, held_out_force_error(samples, usual.degree).all);
  for (int degree = usual.degree + 1; degree <= 7; ++degree)
    EXPECT_GE(held_out_error(samples, degree).all, usual.error);
  const DegreeChoice raised = raise_degree(samples, usual);
  EXPECT_GE(raised.degree, 9);
  EXPECT_LE(raised.error, 1e-3 * usual.error);
  EXPECT_TRUE(raised.keeps(1e-3 * usual.error + raised.force_error));
  EXPECT_FALSE(raised.keeps(0.5 * std::max(raised.error, raised.force_error)));
}

TEST(PolynomialFit, DegreesOfAHalfAreNotRaised) {
  const SiteSamples samples = Synthetic(9).samples(60, true);
  const DegreeChoice usual = choose_degree(samples);
  EXPECT_EQ(raise_degree(samples, usual).degree, usual.degree);
}

// Ten equations a sample, and some to spare.
TEST(PolynomialFit, FewSamplesBearLowDegrees) {
  const int degree = choose_degree(Synthetic(9).samples(4)).degree;  // that of rest and three: 30 equations
  EXPECT_GT(degree, 1);
  EXPECT_LE(degree, 3) << "16 terms; the next degree has 31";
  const DegreeChoice none = choose_degree(Synthetic(9).samples(1));
  EXPECT_EQ(none.degree, 1);
  EXPECT_FALSE(none.keeps(1e9)) << "nothing is known of it";
}

TEST(PolynomialFit, HeldOutErrorOfWhatItHoldsIsRounding) {
  EXPECT_LE(held_out_error(Synthetic(4).samples(14), 4).all, kDouble);
  EXPECT_LE(held_out_force_error(Synthetic(4).samples(14), 4).all, 1e3 * kDouble);
}

// ---- Fewer directions

// A field that varies less and less in each further direction, as that of an organ does.
struct SmoothField {
  static constexpr Eigen::Index kFieldRows = 150;

  explicit SmoothField(int degree, bool half) {
    const Eigen::Index terms = num_terms(2, degree);
    TestRandom random(91);
    polynomial.to_unit = any_map();
    polynomial.degree = degree;
    polynomial.linear = random.matrix(kFieldRows, 3);
    const Eigen::MatrixXd mixed = random.matrix(terms, terms);
    Eigen::MatrixXd directions = random.matrix(kFieldRows, terms);
    for (Eigen::Index k = 0; k < terms; ++k) directions.col(k) *= std::pow(0.7, k);
    polynomial.basis = directions * mixed;
    polynomial.coefficients = orthonormal_on_ball(2, degree, half);
    polynomial.energy = random.vector(num_terms(2, degree + 1));
  }

  SitePolynomial polynomial;
};

// max over nodes and points of |difference| / |d|.
double largest_difference(const SitePolynomial& a, const SitePolynomial& b,
                          const std::vector<Eigen::Vector3d>& points) {
  const Eigen::MatrixXd linear = a.linear - b.linear;
  const Eigen::MatrixXd nonlinear = nonlinear_field(a) - nonlinear_field(b);
  const Eigen::Matrix3d from_unit = a.to_unit.inverse();
  double largest = 0;
  for (const Eigen::Vector3d& x : points) {
    const Eigen::VectorXd field = linear * x + nonlinear * hermite_rows(x, 2, a.degree, 0).transpose();
    largest = std::max(largest, largest_node(field) / (from_unit * x).norm());
  }
  return largest;
}

// Where reduce_basis() measures.
std::vector<Eigen::Vector3d> measured_points(bool half) {
  std::vector<Eigen::Vector3d> points = choose_survey_points(128, half, 0);
  for (size_t i = 0; i < 128; ++i) points.push_back(points[i].normalized());
  return points;
}

TEST(PolynomialBasis, KeepsTheToleranceWithFewDirections) {
  constexpr double kRoundingError = 1e-12;  // of sums of a hundred terms with coefficients of a thousand
  for (const bool half : {false, true}) {
    for (const int degree : {3, 5, 7}) {
      const SitePolynomial whole = SmoothField(degree, half).polynomial;
      const auto tested = measured_points(half);
      const auto others = choose_survey_points(2000, half, 1);
      const double size = reduce_basis(whole, half, HUGE_VAL, false).basis_error;
      for (const bool rounded : {false, true}) {
        for (const double part : {0.3, 0.03, 3e-3}) {
          SCOPED_TRACE(testing::Message() << "degree " << degree << (half ? " half" : "")
                                          << (rounded ? " rounded " : " ") << part);
          const SitePolynomial reduced = reduce_basis(whole, half, part * size, rounded);
          EXPECT_EQ(reduced.to_unit, whole.to_unit);
          EXPECT_EQ(reduced.degree, degree);
          if (!rounded) {
            EXPECT_EQ(reduced.linear, whole.linear);
          }
          EXPECT_EQ(reduced.energy, whole.energy);
          const Eigen::Index rank = reduced.basis.cols();
          ASSERT_EQ(reduced.coefficients.cols(), rank);
          ASSERT_EQ(reduced.coefficients.rows(), whole.coefficients.rows());
          EXPECT_GT(rank, 0);
          EXPECT_LE(rank, pack::kMostRank);
          if (degree > 3) {
            EXPECT_LT(rank, num_terms(2, degree) / 2 + 4);
          }
          EXPECT_LE(reduced.basis_error, part * size);
          EXPECT_NEAR(reduced.basis_error, largest_difference(reduced, whole, tested), kRoundingError * size);
          // Elsewhere in the domain it is not much worse.
          EXPECT_LE(largest_difference(reduced, whole, others), 2 * part * size);
          EXPECT_LE(reduced.basis.cwiseAbs().maxCoeff(), 1);
          if (rounded) {
            EXPECT_EQ(rank % 2, 0);
            const auto expect_integers = [](const Eigen::MatrixXd& integers) {
              EXPECT_LE((integers - integers.array().round().matrix()).cwiseAbs().maxCoeff(), 1e-10);
            };
            expect_integers(pack::kBasisUnit * reduced.basis);
            const double unit = static_cast<double>(linear_unit(whole.linear));
            EXPECT_EQ(linear_unit(reduced.linear), linear_unit(whole.linear));
            expect_integers(pack::kBasisUnit / unit * reduced.linear);
            EXPECT_LE((reduced.linear - whole.linear).cwiseAbs().maxCoeff(),
                      0.5001 * unit / pack::kBasisUnit);
          }
        }
      }
    }
  }
}

// The error that is said counts what rounding to int16 does, which no rank takes away.
TEST(PolynomialBasis, RoundingIsPartOfTheErrorStated) {
  const SitePolynomial whole = SmoothField(4, false).polynomial;
  const auto tested = measured_points(false);
  const double size = reduce_basis(whole, false, HUGE_VAL, false).basis_error;
  const SitePolynomial exact = reduce_basis(whole, false, 0, false);
  EXPECT_EQ(exact.basis.cols(), num_terms(2, 4));
  EXPECT_LE(exact.basis_error, 1e-12 * size);
  const SitePolynomial rounded = reduce_basis(whole, false, 0, true);
  EXPECT_EQ(rounded.basis.cols(), num_terms(2, 4));
  EXPECT_GT(rounded.basis_error, 1e-7 * size);
  EXPECT_LE(rounded.basis_error, 1e-3 * size);
  EXPECT_NEAR(rounded.basis_error, largest_difference(rounded, whole, tested), 1e-12 * size);
}

TEST(PolynomialBasis, NoMoreThanAPackHolds) {
  const SitePolynomial whole = SmoothField(7, false).polynomial;
  const SitePolynomial reduced = reduce_basis(whole, false, 0, false);
  EXPECT_EQ(reduced.basis.cols(), static_cast<Eigen::Index>(pack::kMostRank));
  EXPECT_GT(reduced.basis_error, 0);
}

TEST(PolynomialBasis, NoneWhereNoneIsNeeded) {
  const SitePolynomial whole = SmoothField(3, true).polynomial;
  for (const bool rounded : {false, true}) {
    const SitePolynomial none = reduce_basis(whole, true, HUGE_VAL, rounded);
    EXPECT_EQ(none.basis.cols(), 0);
    EXPECT_EQ(none.coefficients.cols(), 0);
    EXPECT_NEAR(none.basis_error, largest_difference(none, whole, measured_points(true)),
                1e-12 * none.basis_error);
  }
  SitePolynomial linear;
  linear.to_unit = any_map();
  linear.degree = 1;
  linear.linear = whole.linear;
  linear.basis.resize(whole.linear.rows(), 0);
  const SitePolynomial reduced = reduce_basis(linear, true, 0, false);
  EXPECT_EQ(reduced.basis.cols(), 0);
  EXPECT_EQ(reduced.basis_error, 0);
  const SitePolynomial rounded = reduce_basis(linear, true, 0, true);
  EXPECT_EQ(rounded.basis.cols(), 0);
  EXPECT_GT(rounded.basis_error, 0);
  EXPECT_LE(rounded.basis_error, 1e-3);
}

// ---- The design

TEST(PolynomialFitDesign, RowsAreValuesAndDerivatives) {
  // Central differences of degree 5 on the unit ball: 1e-10 of truncation and of rounding, times up to 60.
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
        // The derivative of a row by x_p is the row whose monomial has one more of it.
        pack::for_each_monomial(2, [&](std::uint32_t row, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
          const std::uint32_t derivative = pack::monomial_index(a + (p == 0), b + (p == 1), c + (p == 2));
          EXPECT_LE((rows.row(derivative) - slope.row(row)).cwiseAbs().maxCoeff(), kDifference) << p << row;
        });
      }
    }
  }
}

TEST(PolynomialFitDesign, WeightsFallWithTheOrder) {
  EXPECT_EQ(derivative_weight(3, 0), 1);
  EXPECT_EQ(derivative_weight(3, 1), 1.0 / 4);
  EXPECT_EQ(derivative_weight(3, 2), 1.0 / 4 / 3);
}

}  // namespace
}  // namespace palpate
