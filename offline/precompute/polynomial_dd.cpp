#include "offline/precompute/polynomial_dd.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "offline/numerics/decompositions.hpp"
#include "offline/precompute/ball_polynomials.hpp"
#include "offline/precompute/error_survey.hpp"
#include "offline/precompute/hermite_design.hpp"
#include "schemas/monomials.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

Eigen::Index num_terms(int first, int last) {
  return pack::num_monomials(static_cast<uint32_t>(first), static_cast<uint32_t>(last));
}

// Returns R: derivatives by x = A d up to `order`, in the order of a pack, are R times derivatives by d. With
// M = A^-1, d/dx_i = sum_j M_ji d/dd_j for each differentiation.
Eigen::MatrixXd derivatives_by_unit(int order, const Eigen::Matrix3d& M) {
  const Eigen::Index size = num_terms(0, order);
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(size, size);
  pack::for_each_monomial(static_cast<uint32_t>(order),
                          [&](uint32_t row, uint32_t a, uint32_t b, uint32_t c) {
                            std::vector<int> axes;  // i of each d/dx_i
                            axes.insert(axes.end(), a, 0);
                            axes.insert(axes.end(), b, 1);
                            axes.insert(axes.end(), c, 2);
                            // Sum over all tuples of axes j.
                            int tuples = 1;
                            for (size_t k = 0; k < axes.size(); ++k) tuples *= 3;
                            for (int tuple = 0; tuple < tuples; ++tuple) {
                              std::array<uint32_t, 3> powers = {};
                              double factor = 1;
                              int remaining = tuple;
                              for (const int i : axes) {
                                const int j = remaining % 3;
                                remaining /= 3;
                                ++powers[static_cast<size_t>(j)];
                                factor *= M(j, i);
                              }
                              map(row, pack::monomial_index(powers[0], powers[1], powers[2])) += factor;
                            }
                          });
  return map;
}

// Returns the weight of a sample at x: 1 / |x| for relative errors, with |x| floored at a tenth of the range.
// Beyond the domain the weight falls by |x|^degree, the growth of the remainder.
double sample_weight(const Eigen::Vector3d& x, int degree) {
  const double size = x.norm();
  return std::pow(std::max(size, 1.0), -degree) / std::max(size, 0.1);
}

// A least-squares problem in blocks of rows, one for each sample.
struct HermiteSystem {
  Eigen::MatrixXd to_monomials;  // T of ball_polynomials.hpp: the columns of `design` are q = T^T m
  Eigen::MatrixXd design;
  Eigen::MatrixXd values;
  Eigen::VectorXd weights;  // one for each sample
  Eigen::Index block = 0;   // rows of each sample
};

// Sets up a fit in degrees first .. last. `known(sample)` returns the data: a column for each function, a row
// for each derivative by d up to `order`. The fit serves derivatives of order `wanted`.
template <typename Known>
HermiteSystem hermite_system(const SiteSamples& samples, int first, int last, int order, int wanted,
                             Known&& known) {
  HermiteSystem system;
  system.to_monomials = orthonormal_on_ball(first, last, samples.half);
  system.block = num_terms(0, order);
  const auto count = static_cast<Eigen::Index>(samples.samples.size());
  system.design.resize(system.block * count, system.to_monomials.cols());
  system.weights.resize(count);
  const Eigen::VectorXd row_weights = derivative_weights(last - wanted, order, wanted);
  const Eigen::MatrixXd to_values =
      row_weights.asDiagonal() * derivatives_by_unit(order, samples.to_unit.inverse());
  for (Eigen::Index i = 0; i < count; ++i) {
    const Sample& sample = samples.samples[static_cast<size_t>(i)];
    const Eigen::Vector3d x = samples.to_unit * sample.displacement;
    const double weight = sample_weight(x, last);
    system.weights[i] = weight;
    system.design.middleRows(system.block * i, system.block) =
        weight * row_weights.asDiagonal() * hermite_rows(x, first, last, order) * system.to_monomials;
    const Eigen::MatrixXd values = weight * (to_values * known(sample));
    if (i == 0) system.values.resize(system.block * count, values.cols());
    system.values.middleRows(system.block * i, system.block) = values;
  }
  return system;
}

// Fits u - L d with its first and second derivatives in degrees 2 .. degree.
HermiteSystem field_system(const SiteSamples& samples, int degree) {
  const Eigen::MatrixXd& L = samples.linear.field;
  return hermite_system(samples, 2, degree, 2, 0, [&](const Sample& sample) {
    Eigen::MatrixXd known(10, L.rows());
    const Eigen::VectorXd linear = L * sample.displacement;
    known.row(0) = (sample.field - linear).transpose();
    known.middleRows<3>(1) = (sample.field_tangent - L).transpose();
    known.middleRows<6>(4) = sample.field_curvature.transpose();
    return known;
  });
}

// Fits E - d S d / 2 with derivatives up to the third in degrees 3 .. degree + 1, for the force.
HermiteSystem energy_system(const SiteSamples& samples, int degree) {
  const Eigen::Matrix3d& S = samples.linear.stiffness;
  return hermite_system(samples, 3, degree + 1, 3, 1, [&](const Sample& sample) {
    Eigen::MatrixXd known(20, 1);
    const Eigen::Matrix3d excess = sample.stiffness - S;
    known << sample.energy - 0.5 * sample.displacement.dot(S * sample.displacement),
        sample.force - S * sample.displacement, excess(0, 0), excess(0, 1), excess(0, 2), excess(1, 1),
        excess(1, 2), excess(2, 2), sample.hardening;
    return known;
  });
}

// The orthonormal factor Q of a design of full rank.
class OrthonormalFactor {
 public:
  explicit OrthonormalFactor(const Eigen::MatrixXd& design) : factor_(design), terms_(design.cols()) {}

  bool exists() const {
    constexpr double kLeastPart = 1e-10;
    if (factor_.rows() < terms_) return false;
    const Eigen::VectorXd diagonal = factor_.matrixQR().diagonal().cwiseAbs();
    return diagonal.minCoeff() > kLeastPart * diagonal.maxCoeff();
  }
  Eigen::MatrixXd columns() const {
    return factor_.householderQ() * Eigen::MatrixXd::Identity(factor_.rows(), terms_);
  }
  Eigen::MatrixXd solve(const Eigen::MatrixXd& values) const {
    if (!exists()) throw std::invalid_argument("the samples do not determine the polynomial");
    return factor_.solve(values);
  }

 private:
  Eigen::HouseholderQR<Eigen::MatrixXd> factor_;
  Eigen::Index terms_;
};

// Returns leave-one-out root mean squares of measure(sample, error) over the domain's samples without rest.
// `error` [functions x `count`]: the residuals of `count` rows of the sample's block, from `first_row` on.
template <typename Measure>
HeldOutError held_out(const SiteSamples& samples, const HermiteSystem& system, Eigen::Index first_row,
                      Eigen::Index count, Measure&& measure) {
  constexpr double kWellInside = 0.9;
  constexpr int kFewest = 4;
  constexpr HeldOutError kUnknown = {std::numeric_limits<double>::infinity(),
                                     std::numeric_limits<double>::infinity()};
  const OrthonormalFactor factor(system.design);
  if (!factor.exists()) return kUnknown;
  const Eigen::MatrixXd Q = factor.columns();
  const Eigen::MatrixXd residuals = system.values - Q * (Q.transpose() * system.values);
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(system.block, system.block);
  double squares = 0;
  double squares_inside = 0;
  int pushes = 0;
  int pushes_inside = 0;
  for (size_t i = 0; i < samples.samples.size(); ++i) {
    const Sample& sample = samples.samples[i];
    if (sample.displacement.isZero(0) || !is_in_domain(samples, sample)) continue;
    const auto first = static_cast<Eigen::Index>(i) * system.block;
    const auto Q_b = Q.middleRows(first, system.block);
    const Eigen::MatrixXd rows =
        solve_definite(identity - Q_b * Q_b.transpose(), identity.middleCols(first_row, count));
    const Eigen::MatrixXd error = residuals.middleRows(first, system.block).transpose() * rows /
                                  system.weights[static_cast<Eigen::Index>(i)];
    const double size = measure(sample, error);
    squares += size * size;
    ++pushes;
    if ((samples.to_unit * sample.displacement).norm() > kWellInside) continue;
    squares_inside += size * size;
    ++pushes_inside;
  }
  if (pushes == 0) return kUnknown;
  const double all = std::sqrt(squares / pushes);
  return {all, pushes_inside < kFewest ? all : std::sqrt(squares_inside / pushes_inside)};
}

}  // namespace

bool is_in_domain(const SiteSamples& samples, const Sample& sample) {
  constexpr double kRounding = 1e-9;
  return (samples.to_unit * sample.displacement).norm() <= 1 + kRounding;
}

double force_floor(const SiteSamples& samples) {
  double largest = 0;
  for (const Sample& sample : samples.samples) {
    if (is_in_domain(samples, sample)) largest = std::max(largest, sample.force.norm());
  }
  return kForceFloor * largest;
}

double least_reach(const Eigen::Matrix3d& to_unit) {
  return 1 / to_unit.jacobiSvd().singularValues()[0];
}

int highest_fit_degree(bool half) {
  constexpr int kOfHalf = 7;
  return half ? kOfHalf : static_cast<int>(pack::kMaxDegree);
}

HeldOutError held_out_error(const SiteSamples& samples, int degree) {
  return held_out(samples, field_system(samples, degree), 0, 1,
                  [](const Sample& sample, const Eigen::MatrixXd& error) {
                    return largest_node(error.col(0)) / sample.displacement.norm();
                  });
}

HeldOutError held_out_force_error(const SiteSamples& samples, int degree) {
  const double floor = force_floor(samples);
  // Rows 1 to 3 are derivatives by x, of weight 1.
  return held_out(samples, energy_system(samples, degree), 1, 3,
                  [&](const Sample& sample, const Eigen::MatrixXd& error) {
                    return (samples.to_unit.transpose() * error.transpose()).norm() /
                           std::max(sample.force.norm(), floor);
                  });
}

SitePolynomial fit_polynomial(const SiteSamples& samples, int degree) {
  SitePolynomial polynomial;
  polynomial.to_unit = samples.to_unit;
  polynomial.degree = degree;
  const Eigen::Matrix3d from_unit = samples.to_unit.inverse();
  polynomial.linear = samples.linear.field * from_unit;
  const Eigen::Matrix3d S = from_unit.transpose() * samples.linear.stiffness * from_unit;
  polynomial.energy.resize(num_terms(2, degree + 1));
  polynomial.energy.head<6>() << 0.5 * S(0, 0), S(0, 1), S(0, 2), 0.5 * S(1, 1), S(1, 2), 0.5 * S(2, 2);
  polynomial.basis.resize(polynomial.linear.rows(), 0);
  if (degree == 1) return polynomial;
  const HermiteSystem field = field_system(samples, degree);
  polynomial.basis = OrthonormalFactor(field.design).solve(field.values).transpose();
  polynomial.coefficients = field.to_monomials;
  const HermiteSystem energy = energy_system(samples, degree);
  polynomial.energy.tail(num_terms(3, degree + 1)) =
      energy.to_monomials * OrthonormalFactor(energy.design).solve(energy.values);
  return polynomial;
}

Eigen::VectorXd field_at(const SitePolynomial& polynomial, const Eigen::Vector3d& displacement) {
  const Eigen::Vector3d x = polynomial.to_unit * displacement;
  const Eigen::VectorXd monomials = hermite_rows(x, 2, polynomial.degree, 0).transpose();
  return polynomial.linear * x + polynomial.basis * (polynomial.coefficients.transpose() * monomials);
}

Eigen::Vector3d force_at(const SitePolynomial& polynomial, const Eigen::Vector3d& displacement) {
  const Eigen::Vector3d x = polynomial.to_unit * displacement;
  return polynomial.to_unit.transpose() *
         (hermite_rows(x, 2, polynomial.degree + 1, 1).bottomRows<3>() * polynomial.energy);
}

SampleErrors errors_of(const SitePolynomial& polynomial, const Sample& sample, double force_floor) {
  const Eigen::Vector3d& d = sample.displacement;
  return errors_at({field_at(polynomial, d), force_at(polynomial, d)}, sample, force_floor);
}

float linear_unit(const Eigen::MatrixXd& linear) {
  const double largest = linear.cwiseAbs().maxCoeff();
  const auto unit = static_cast<float>(largest);
  return static_cast<double>(unit) < largest ? std::nextafter(unit, HUGE_VALF) : unit;
}

SitePolynomial reduce_basis(const SitePolynomial& polynomial, bool half, double tolerance, bool rounded) {
  constexpr double kUnit = pack::kBasisUnit;
  SitePolynomial reduced = polynomial;
  if (polynomial.basis.cols() > 0) {
    // Columns of B belong to orthonormal functions: eigenvectors of B^T B are principal directions.
    const Eigen::MatrixXd V =
        symmetric_modes(polynomial.basis.transpose() * polynomial.basis).vectors.rowwise().reverse();
    reduced.basis = polynomial.basis * V;
    reduced.coefficients = polynomial.coefficients * V;
  }
  if (rounded) {
    const double entry = static_cast<double>(linear_unit(polynomial.linear)) / kUnit;
    if (entry > 0) reduced.linear = (polynomial.linear / entry).array().round() * entry;
  }

  constexpr int kInside = 128;
  // one half inside, one half on the boundary, where the truncation error is largest
  constexpr int kPoints = 2 * kInside;
  Eigen::MatrixXd points(3, kPoints);
  Eigen::MatrixXd monomials(polynomial.coefficients.rows(), kPoints);
  Eigen::VectorXd sizes(kPoints);  // |d|
  const Eigen::Matrix3d from_unit = polynomial.to_unit.inverse();
  const std::vector<Eigen::Vector3d> inside = choose_survey_points(kInside, half, 0);
  for (int i = 0; i < kPoints; ++i) {
    const Eigen::Vector3d& point = inside[static_cast<size_t>(i / 2)];
    const Eigen::Vector3d x = i % 2 == 0 ? point : point.normalized();
    points.col(i) = x;
    monomials.col(i) = hermite_rows(x, 2, polynomial.degree, 0).transpose();
    sizes[i] = (from_unit * x).norm();
  }
  const Eigen::MatrixXd z = reduced.coefficients.transpose() * monomials;
  Eigen::MatrixXd truncated = (polynomial.linear - reduced.linear) * points + reduced.basis * z;
  const auto error = [&] {
    double largest = 0;
    for (int i = 0; i < kPoints; ++i) largest = std::max(largest, largest_node(truncated.col(i)) / sizes[i]);
    return largest;
  };
  const auto most = std::min<Eigen::Index>(pack::kMostRank, reduced.basis.cols());
  Eigen::Index rank = 0;
  reduced.basis_error = error();
  while (reduced.basis_error > tolerance && rank < most) {
    // Subtract the columns as a pack stores them.
    for (const Eigen::Index next = std::min(most, rank + 2); rank < next; ++rank) {
      auto column = reduced.basis.col(rank);
      const double size = column.cwiseAbs().maxCoeff();
      if (size > 0) {
        column /= size;
        reduced.coefficients.col(rank) *= size;
      }
      if (rounded) column = (column * kUnit).array().round() / kUnit;
      truncated.noalias() -= column * (size > 0 ? size : 1.0) * z.row(rank);
    }
    reduced.basis_error = error();
  }
  reduced.basis.conservativeResize(Eigen::NoChange, rank);
  reduced.coefficients.conservativeResize(Eigen::NoChange, rank);
  return reduced;
}

}  // namespace palpate
