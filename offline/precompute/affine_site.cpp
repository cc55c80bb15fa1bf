#include "offline/precompute/affine_site.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>

#include "offline/numerics/decompositions.hpp"
#include "offline/precompute/ball_polynomials.hpp"
#include "offline/precompute/hermite_design.hpp"
#include "offline/precompute/sample_points.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

// The region of a map: a ball about the midpoint of site s and contact t.
struct Region {
  Eigen::Vector3d middle;
  double radius;
  std::vector<Eigen::Vector3d> edge;  // surface nodes on the region's boundary
};

// The radius is 2 h + |s - t|. Where the ball would contain fixed nodes, it ends at the nearest fixed node.
Region region_of(const Model& model, const ContactSites& sites, const Eigen::Vector3d& s,
                 const Eigen::Vector3d& t) {
  constexpr double kLeastRadius = 2;  // multiple of h
  const double h = sites.mean_surface_edge;
  Region region{(s + t) / 2, kLeastRadius * h + (s - t).norm(), {}};
  const std::vector<char> fixed = model.fixed_nodes();
  double to_fixed = std::numeric_limits<double>::infinity();
  for (size_t node = 0; node < fixed.size(); ++node) {
    if (fixed[node]) to_fixed = std::min(to_fixed, (model.positions[node] - region.middle).norm());
  }
  const bool meets_fixed = to_fixed < region.radius;
  region.radius = std::min(region.radius, to_fixed);
  for (const int node : sites.packed_nodes) {
    const Eigen::Vector3d& at = model.positions[static_cast<size_t>(node)];
    const bool is_candidate = !meets_fixed || fixed[static_cast<size_t>(node)];
    if (is_candidate && std::abs((at - region.middle).norm() - region.radius) < 0.75 * h)
      region.edge.push_back(at);
  }
  return region;
}

double condition_of(const Eigen::Matrix3d& matrix) {
  const Eigen::Vector3d values = matrix.jacobiSvd().singularValues();
  return values[0] / values[2];
}

// Eq. (25): [b1 b2 t] = phi [b1 b2 s]. The paper leaves b1 and b2 open; the best-conditioned pair is taken.
std::optional<Placement> place_as_paper(const Region& region, const Eigen::Vector3d& s,
                                        const Eigen::Vector3d& t, bool inverse) {
  Eigen::Matrix3d from;
  Eigen::Matrix3d to;
  double best = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < region.edge.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      Eigen::Matrix3d tried;
      tried << region.edge[i], region.edge[j], s;
      const double condition = condition_of(tried);
      if (!(condition < best)) continue;
      best = condition;
      from = tried;
      to << region.edge[i], region.edge[j], t;
    }
  }
  constexpr double kSingular = 1e10;
  if (!(best < kSingular) || !(condition_of(to) < kSingular)) return std::nullopt;
  Placement placement;
  placement.of_places = inverse ? from * to.inverse() : to * from.inverse();
  placement.condition = best;
  return placement;
}

// phi(x) = t + A (x - s), A the least-squares solution of phi(b) = b on the boundary. The regularisation
// keeps undetermined directions unchanged.
std::optional<Placement> place_affinely(const Region& region, const Eigen::Vector3d& s,
                                        const Eigen::Vector3d& t) {
  constexpr double kRegularisation = 1e-3;
  Eigen::Matrix3d gram = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d image = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& b : region.edge) {
    gram += (b - s) * (b - s).transpose();
    image += (b - t) * (b - s).transpose();
  }
  const double regularisation = kRegularisation * gram.trace();
  if (!(regularisation > 0)) return std::nullopt;
  gram.diagonal().array() += regularisation;
  image.diagonal().array() += regularisation;
  const Eigen::Matrix3d A = image * gram.inverse();
  if (!(std::abs(A.determinant()) > 1e-6)) return std::nullopt;
  Placement placement;
  placement.of_places = A.inverse();
  placement.condition = condition_of(A);
  placement.at_contact = t;
  placement.at_site = s;
  return placement;
}

// Barycentric coordinates of the point of a b c nearest to p (Ericson 2005, Real-Time Collision Detection).
std::array<double, 3> nearest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                          const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const double d1 = ab.dot(p - a);
  const double d2 = ac.dot(p - a);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double d3 = ab.dot(p - b);
  const double d4 = ac.dot(p - b);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {d3 / (d3 - d1), d1 / (d1 - d3), 0};
  const double d5 = ab.dot(p - c);
  const double d6 = ac.dot(p - c);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {d6 / (d6 - d2), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double w = (d4 - d3) / (d4 - d3 + d5 - d6);
    return {0, 1 - w, w};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

// Interpolates the rows of a field (three for each packed node) by `table` and maps the vectors by Q.
Eigen::MatrixXd transferred_rows(const Eigen::MatrixXd& rows, const Placement& placement,
                                 const LocalTable& table) {
  Eigen::MatrixXd out(rows.rows(), rows.cols());
  for (size_t node = 0; node < table.nodes.size(); ++node) {
    Eigen::MatrixXd interpolated = Eigen::MatrixXd::Zero(3, rows.cols());
    for (size_t k = 0; k < 3; ++k) {
      if (table.weights[node][k] != 0)
        interpolated += table.weights[node][k] * rows.middleRows<3>(Eigen::Index{3} * table.nodes[node][k]);
    }
    out.middleRows<3>(3 * static_cast<Eigen::Index>(node)) = placement.of_vectors * interpolated;
  }
  return out;
}

}  // namespace

SitePolynomial unsampled_polynomial(const SiteLinearResponse& linear, const TaylorCoefficients& series,
                                    const Eigen::Matrix3d& to_unit, bool half) {
  // x = A d = s y: a coefficient of degree k scales with s^-k.
  const double s = (to_unit * series.axes)(0, 0);
  const auto degree_scales = [&](int first, int last) {
    Eigen::VectorXd factors(pack::num_monomials(static_cast<uint32_t>(first), static_cast<uint32_t>(last)));
    Eigen::Index place = 0;
    for (int degree = first; degree <= last; ++degree) {
      const Eigen::Index count = pack::num_monomials(static_cast<uint32_t>(degree));
      factors.segment(place, count).setConstant(std::pow(s, -degree));
      place += count;
    }
    return factors;
  };
  SitePolynomial polynomial;
  polynomial.to_unit = to_unit;
  polynomial.degree = kSeriesDegree;
  const Eigen::Matrix3d from_unit = to_unit.inverse();
  polynomial.linear = linear.field * from_unit;
  // F m = (F T^-T) (T^T m). As T^T m are orthonormal, a column of F T^-T has its share of the field as norm.
  polynomial.coefficients = orthonormal_on_ball(2, kSeriesDegree, half);
  polynomial.basis = polynomial.coefficients.triangularView<Eigen::Upper>()
                         .solve(degree_scales(2, kSeriesDegree).asDiagonal() * series.field.transpose())
                         .transpose();
  const Eigen::Matrix3d S = from_unit.transpose() * linear.stiffness * from_unit;
  polynomial.energy.resize(pack::num_monomials(2, kSeriesDegree + 1));
  polynomial.energy << 0.5 * S(0, 0), S(0, 1), S(0, 2), 0.5 * S(1, 1), S(1, 2), 0.5 * S(2, 2),
      degree_scales(3, kSeriesDegree + 1).asDiagonal() * series.energy;
  return polynomial;
}

std::array<Eigen::Vector3d, 2> least_certain_points(const SitePolynomial& polynomial, bool half) {
  constexpr int kDirections = 96;
  constexpr double kApart = 0.5;  // cosine of the least angle
  const Eigen::Index terms = pack::num_monomials(static_cast<uint32_t>(polynomial.degree));
  const Eigen::MatrixXd last = polynomial.basis * polynomial.coefficients.bottomRows(terms).transpose();
  std::array<Eigen::Vector3d, 2> points = {Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX()};
  std::array<double, 2> largest = {-1, -1};
  for (size_t i = 0; i < 2; ++i) {
    for (const Eigen::Vector3d& x : sphere_points(kDirections)) {
      if ((half && x.z() < 0) || (i == 1 && x.dot(points[0]) > kApart)) continue;
      const Eigen::VectorXd field =
          last * hermite_rows(x, polynomial.degree, polynomial.degree, 0).transpose();
      const double size = field.reshaped(3, field.size() / 3).colwise().squaredNorm().maxCoeff();
      if (size <= largest[i] * (1 + 1e-9)) continue;
      largest[i] = size;
      points[i] = x;
    }
  }
  return points;
}

std::optional<Placement> place_contact(const Model& model, const ContactSites& sites, SiteMap map,
                                       const ContactSite& site, const ContactSite& contact) {
  const Eigen::Vector3d& s = model.positions[static_cast<size_t>(site.node)];
  const Eigen::Vector3d& t = model.positions[static_cast<size_t>(contact.node)];
  std::optional<Placement> placement;
  if (map == SiteMap::rigid) {
    placement.emplace();
    placement->at_contact = t;
    placement->at_site = s;
    placement->of_vectors = rotation_between(site.inward, contact.inward);
    placement->of_places = placement->of_vectors.transpose();
    return placement;
  }
  const Region region = region_of(model, sites, s, t);
  placement = map == SiteMap::affine ? place_affinely(region, s, t)
                                     : place_as_paper(region, s, t, map == SiteMap::inverse);
  if (placement) {
    placement->middle = region.middle;
    placement->reach = region.radius;
  }
  return placement;
}

LocalTable local_table(const Model& model, const ContactSites& sites, const Placement& placement) {
  const size_t num_nodes = sites.packed_nodes.size();
  std::vector<Eigen::Vector3d> places;
  for (const int node : sites.packed_nodes) places.push_back(model.positions[static_cast<size_t>(node)]);
  std::vector<std::vector<size_t>> around(num_nodes);
  for (size_t triangle = 0; triangle < sites.triangles.size(); ++triangle) {
    for (const int corner : sites.triangles[triangle])
      around[static_cast<size_t>(corner)].push_back(triangle);
  }
  LocalTable table;
  for (size_t node = 0; node < num_nodes; ++node) {
    const int itself = static_cast<int>(node);
    table.nodes.push_back({itself, itself, itself});
    table.weights.push_back({1, 0, 0});
    if ((places[node] - placement.middle).norm() > placement.reach) continue;
    const Eigen::Vector3d q = placement.at_site + placement.of_places * (places[node] - placement.at_contact);
    const auto nearer = [&](const Eigen::Vector3d& one, const Eigen::Vector3d& other) {
      return (one - q).squaredNorm() < (other - q).squaredNorm();
    };
    const auto nearest =
        static_cast<int>(std::min_element(places.begin(), places.end(), nearer) - places.begin());
    table.nodes.back() = {nearest, nearest, nearest};
    if (around[node].empty()) continue;  // inner node
    double least = (places[static_cast<size_t>(nearest)] - q).squaredNorm();
    for (const size_t first : around[static_cast<size_t>(nearest)]) {
      for (const int corner : sites.triangles[first]) {
        for (const size_t tried : around[static_cast<size_t>(corner)]) {
          const std::array<int, 3>& triangle = sites.triangles[tried];
          const auto at = [&](size_t k) -> const Eigen::Vector3d& {
            return places[static_cast<size_t>(triangle[k])];
          };
          const std::array<double, 3> weights = nearest_on_triangle(q, at(0), at(1), at(2));
          const double distance =
              (weights[0] * at(0) + weights[1] * at(1) + weights[2] * at(2) - q).squaredNorm();
          if (distance >= least) continue;
          least = distance;
          table.nodes.back() = triangle;
          table.weights.back() = weights;
        }
      }
    }
  }
  return table;
}

SitePolynomial moved(const SitePolynomial& polynomial, const Placement& placement, const LocalTable& table) {
  SitePolynomial out = polynomial;
  out.to_unit = polynomial.to_unit * placement.of_vectors.transpose();
  out.linear = transferred_rows(polynomial.linear, placement, table);
  out.basis = transferred_rows(polynomial.basis, placement, table);
  return out;
}

SitePolynomial moved_remainder(const SitePolynomial& polynomial, const Placement& placement,
                               const LocalTable& table) {
  SitePolynomial out = moved(polynomial, placement, table);
  out.linear.setZero();
  out.energy.head<6>().setZero();
  return out;
}

std::vector<double> site_weights(const std::vector<Eigen::Vector3d>& places, const Eigen::Vector3d& contact,
                                 const Eigen::Vector3d& normal) {
  double farthest = 0;
  for (const Eigen::Vector3d& place : places) farthest = std::max(farthest, (place - contact).norm());
  // The kernel is zero at the farthest site, and so large at a coincident site that only this site counts.
  Eigen::Matrix3d tangents = Eigen::Matrix3d::Identity() - normal * normal.transpose();
  const auto count = static_cast<Eigen::Index>(places.size());
  Eigen::MatrixXd terms(count, 4);
  Eigen::VectorXd kernel(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d offset = places[static_cast<size_t>(i)] - contact;
    const double part = offset.norm() / farthest;
    terms.row(i) << 1, (tangents * offset).transpose() / farthest;
    kernel[i] = std::pow(1 - part, 2) / (part * part + 1e-12);
  }
  // The projected offsets leave the normal direction undetermined; the diagonal term makes `gram` definite.
  Eigen::Matrix4d gram = terms.transpose() * kernel.asDiagonal() * terms;
  gram.diagonal().tail<3>().array() += 1e-3 * kernel.sum() / static_cast<double>(places.size());
  const Eigen::Vector4d multipliers = solve_definite(gram, Eigen::Vector4d::Unit(0));
  std::vector<double> weights(places.size());
  double sum = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    weights[static_cast<size_t>(i)] = kernel[i] * terms.row(i).dot(multipliers);
    sum += weights[static_cast<size_t>(i)];
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

}  // namespace palpate
