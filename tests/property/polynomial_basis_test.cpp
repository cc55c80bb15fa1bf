// The reduced basis for the fields of a fit.
#include <gtest/gtest.h>

#include "tests/support/polynomial_fit_fixture.hpp"

namespace palpate::polynomial_fit_fixture {
namespace polynomial_basis_test {

// ---- Rank of the basis

// A field that decays from direction to direction, as an organ's does.
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

// The points at which reduce_basis() measures.
std::vector<Eigen::Vector3d> measured_points(bool half) {
  std::vector<Eigen::Vector3d> points = choose_survey_points(128, half, 0);
  for (size_t i = 0; i < 128; ++i) points.push_back(points[i].normalized());
  return points;
}

TEST(PolynomialBasis, KeepsTheToleranceWithFewDirections) {
  constexpr double kRoundingError = 1e-12;  // sums of a hundred terms with coefficients of a thousand
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
          // At other points of the domain the error is at most a little larger.
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

// The stated error includes rounding to int16, which a higher rank cannot remove.
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

}  // namespace polynomial_basis_test
}  // namespace palpate::polynomial_fit_fixture
