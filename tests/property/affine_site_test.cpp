// The Taylor series of a contact at rest, and the affine maps that transfer a site's response to another
// contact.
#include "offline/precompute/affine_site.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <utility>

#include "offline/precompute/hermite_design.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate::test {
namespace affine_site_test {

constexpr std::array kMaps = {SiteMap::printed, SiteMap::inverse, SiteMap::affine, SiteMap::rigid};

Eigen::Vector3d place_of(const TouchedBlock& block, size_t site) {
  return block.model.positions[static_cast<size_t>(block.sites.sites[site].node)];
}

Eigen::Vector3d image(const Placement& placement, const Eigen::Vector3d& place) {
  return placement.at_site + placement.of_places * (place - placement.at_contact);
}

TouchedBlock flat_block(const Eigen::Vector3d& away,
                        const Eigen::Matrix3d& turn = Eigen::Matrix3d::Identity()) {
  TouchedBlock block;
  BlockShape shape;
  shape.cells = {6, 6, 6};
  shape.jitter = 0;
  block.model = with_fixed_base(tetrahedral_block(shape));
  for (const int node : nodes_on_plane(block.model, 2, 1.0)) {
    const Eigen::Vector3d& at = block.model.positions[static_cast<size_t>(node)];
    if (at.x() > 0.2 && at.x() < 0.8 && at.y() > 0.2 && at.y() < 0.8) block.scene.sites.push_back(node);
  }
  for (Eigen::Vector3d& position : block.model.positions) position = turn * position + away;
  block.scene.max_displacement = 0.1;
  block.scene.output_nodes = extract_surface(block.model).nodes;
  block.sites = find_contact_sites(block.scene, block.model);
  return block;
}

// The middle site of the block.
struct SolvedSite {
  TouchedBlock block;
  Assembly assembly;
  StaticSolver solver;
  RestState rest;
  const ContactSite& site;
  SiteSampler sampler;
  SitePolynomial polynomial;

  explicit SolvedSite(TouchedBlock touched)
      : block(std::move(touched)),
        assembly(block.model, block.model.fixed_dofs()),
        solver(assembly),
        site(block.sites.sites[block.sites.sites.size() / 2]),
        sampler(solver, block.sites, site, rest) {
    const TaylorCoefficients series =
        *sampler.coefficients_at_rest(block.sites.mean_surface_edge * site.frame);
    polynomial = unsampled_polynomial(linear_response(solver, block.sites, site, rest), series,
                                      site.frame.transpose() / block.scene.max_displacement, false);
  }
};

// The series has five orders, so the error of field and force is of sixth order.
TEST(AffineSite, SeriesAtRestConvergesWithItsOrder) {
  for (const bool ten_nodes : {false, true}) {
    SolvedSite solved(touched_block(ten_nodes ? 3 : 4, 0.3, ten_nodes));
    const Eigen::Vector3d direction = Eigen::Vector3d(0.4, 0.3, -0.86).normalized();
    std::array<double, 2> field_error = {};
    std::array<double, 2> force_error = {};
    for (size_t i = 0; i < 2; ++i) {
      const Eigen::Vector3d d = (i == 0 ? 0.1 : 0.05) * direction;
      Sample truth;
      ASSERT_TRUE(solved.sampler.solve_from_rest(d, 4, truth));
      field_error[i] = (field_at(solved.polynomial, d) - truth.field).norm() / d.norm();
      force_error[i] = (force_at(solved.polynomial, d) - truth.force).norm() / truth.force.norm();
    }
    EXPECT_LT(field_error[0], 5e-4);
    EXPECT_LT(force_error[0], 5e-5);
    EXPECT_NEAR(std::log2(field_error[0] / field_error[1]), 5, 0.7) << ten_nodes;
    EXPECT_NEAR(std::log2(force_error[0] / force_error[1]), 5, 0.7) << ten_nodes;
  }
}

// The first terms equal second derivatives of the field and third derivatives of the energy from the solver.
TEST(AffineSite, SeriesAtRestBeginsWithTheDerivativesThere) {
  SolvedSite solved(touched_block(4, 0.3));
  Sample rest;
  ASSERT_EQ(solved.sampler.solve(Eigen::Vector3d::Zero(), rest), PushOutcome::solved);
  const SitePolynomial& polynomial = solved.polynomial;
  const double size = solved.block.scene.max_displacement;
  for (const Eigen::Vector3d& along : sphere_points(7)) {
    const Eigen::Vector3d d = solved.site.frame * along;
    const Eigen::Vector<double, 6> squares(0.5 * d[0] * d[0], d[0] * d[1], d[0] * d[2], 0.5 * d[1] * d[1],
                                           d[1] * d[2], 0.5 * d[2] * d[2]);
    const Eigen::VectorXd expected = rest.field_curvature * squares * size * size;
    const Eigen::VectorXd found = polynomial.basis * polynomial.coefficients.topRows<6>().transpose() *
                                  hermite_rows(along, 2, 2, 0).transpose();
    EXPECT_LE((found - expected).norm(), 1e-4 * expected.norm());
    const auto& T = rest.hardening;
    const double third = d[0] * d[0] * (T[0] * d[0] + 3 * T[1] * d[1] + 3 * T[2] * d[2]) +
                         d[1] * d[1] * (3 * T[3] * d[0] + T[6] * d[1] + 3 * T[7] * d[2]) +
                         d[2] * d[2] * (3 * T[5] * d[0] + 3 * T[8] * d[1] + T[9] * d[2]) +
                         6 * T[4] * d[0] * d[1] * d[2];
    const double energy = hermite_rows(along, 3, 3, 0).row(0).dot(polynomial.energy.segment<10>(6));
    EXPECT_NEAR(energy, third * std::pow(size, 3) / 6, 1e-5 * rest.stiffness.norm() * size * size);
  }
}

// A linear organ has no terms beyond the linear response.
TEST(AffineSite, SeriesOfALinearOrganIsNil) {
  TouchedBlock block = touched_block(3, 0.3);
  for (Material& material : block.model.materials) material.law = LinearElastic{1.0, 4.0};
  SolvedSite solved(std::move(block));
  EXPECT_LE(solved.polynomial.basis.norm(), 1e-7 * solved.polynomial.linear.norm());
  EXPECT_LE(solved.polynomial.energy.tail(solved.polynomial.energy.size() - 6).norm(),
            1e-7 * solved.polynomial.energy.norm());
}

TEST(AffineSite, TakesTheContactToTheSite) {
  const TouchedBlock block = flat_block({0.3, -0.2, 0.7});
  for (const SiteMap map : kMaps) {
    const auto placement =
        place_contact(block.model, block.sites, map, block.sites.sites[0], block.sites.sites[4]);
    ASSERT_TRUE(placement.has_value());
    const Eigen::Vector3d s = place_of(block, 0);
    const Eigen::Vector3d t = place_of(block, 4);
    if (map == SiteMap::printed) {
      EXPECT_LE((image(*placement, s) - t).norm(), 1e-12) << "the sense that the text has";
    } else {
      EXPECT_LE((image(*placement, t) - s).norm(), 1e-12);
    }
    const auto same =
        place_contact(block.model, block.sites, map, block.sites.sites[2], block.sites.sites[2]);
    ASSERT_TRUE(same.has_value());
    EXPECT_LE((same->of_places - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  }
}

// The paper's map depends on the origin, ours do not. All maps rotate with the organ.
TEST(AffineSite, OnlyThePapersMapDependsOnTheOrigin) {
  const Eigen::Matrix3d R = Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 2, -1).normalized()).matrix();
  const TouchedBlock here = flat_block({0.3, -0.2, 0.7});
  const TouchedBlock there = flat_block({30, 50, -20}, R);
  for (const SiteMap map : kMaps) {
    const auto one = place_contact(here.model, here.sites, map, here.sites.sites[0], here.sites.sites[1]);
    const auto other =
        place_contact(there.model, there.sites, map, there.sites.sites[0], there.sites.sites[1]);
    ASSERT_TRUE(one && other);
    const double difference = (R.transpose() * other->of_places * R - one->of_places).norm();
    if (map == SiteMap::printed || map == SiteMap::inverse) {
      EXPECT_GT(difference, 1e-3);
    } else {
      EXPECT_LE(difference, 1e-9);
    }
  }
}

TEST(AffineSite, ASingularMapIsNone) {
  const TouchedBlock block = flat_block(-place_of(flat_block(Eigen::Vector3d::Zero()), 3));
  ASSERT_LE(place_of(block, 3).norm(), 1e-12);
  const auto at_origin = [&](SiteMap map) {
    return place_contact(block.model, block.sites, map, block.sites.sites[3], block.sites.sites[0])
        .has_value();
  };
  EXPECT_FALSE(at_origin(SiteMap::printed));
  EXPECT_FALSE(at_origin(SiteMap::inverse));
  EXPECT_TRUE(at_origin(SiteMap::affine));
  EXPECT_TRUE(at_origin(SiteMap::rigid));
}

// On a flat regular top, the neighbourhoods of two sites match node by node.
TEST(AffineSite, TableTakesEachNodesCounterpart) {
  const TouchedBlock block = flat_block(Eigen::Vector3d::Zero());
  const auto placement =
      place_contact(block.model, block.sites, SiteMap::rigid, block.sites.sites[0], block.sites.sites[1]);
  const Eigen::Vector3d step = place_of(block, 0) - place_of(block, 1);
  const LocalTable table = local_table(block.model, block.sites, *placement);
  int compared = 0;
  for (size_t node = 0; node < table.nodes.size(); ++node) {
    const Eigen::Vector3d& p = block.model.positions[static_cast<size_t>(block.sites.packed_nodes[node])];
    Eigen::Vector3d taken = Eigen::Vector3d::Zero();
    double sum = 0;
    for (size_t k = 0; k < 3; ++k) {
      taken +=
          table.weights[node][k] * block.model.positions[static_cast<size_t>(
                                       block.sites.packed_nodes[static_cast<size_t>(table.nodes[node][k])])];
      sum += table.weights[node][k];
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    if (p.z() < 1 - 1e-9 || std::abs(p.x() - 0.5) > 0.3 || std::abs(p.y() - 0.5) > 0.3) continue;
    EXPECT_LE((taken - (p + step)).norm(), 1e-12);
    ++compared;
  }
  EXPECT_GE(compared, 9);
}

TEST(AffineSite, EnergyIsThatOfThePushTurnedBack) {
  SitePolynomial polynomial;
  polynomial.to_unit << 5, 1, 0, 0, 6, -1, 0.5, 0, 4;
  polynomial.degree = 2;
  polynomial.linear = Eigen::MatrixXd::Random(6, 3);
  polynomial.basis = Eigen::MatrixXd::Random(6, 2);
  polynomial.coefficients = Eigen::MatrixXd::Random(6, 2);
  polynomial.energy = Eigen::VectorXd::Random(16);
  Placement placement;
  placement.of_vectors = Eigen::AngleAxisd(1.1, Eigen::Vector3d(0, 1, 3).normalized()).matrix();
  const LocalTable table = {{{0, 0, 0}, {1, 1, 1}}, {{1, 0, 0}, {1, 0, 0}}};
  const SitePolynomial turned = moved(polynomial, placement, table);
  const SitePolynomial remainder = moved_remainder(polynomial, placement, table);
  const Eigen::Vector3d d(0.03, -0.05, 0.08);
  const Eigen::Vector3d at_contact = placement.of_vectors * d;
  const auto energy = [](const SitePolynomial& of, const Eigen::Vector3d& at) {
    return hermite_rows(of.to_unit * at, 2, of.degree + 1, 0).row(0).dot(of.energy);
  };
  EXPECT_NEAR(energy(turned, at_contact), energy(polynomial, d), 1e-12);
  const Eigen::VectorXd expected = field_at(polynomial, d);
  const Eigen::VectorXd actual = field_at(turned, at_contact);
  for (Eigen::Index node = 0; node < 2; ++node)
    EXPECT_LE((actual.segment<3>(3 * node) - placement.of_vectors * expected.segment<3>(3 * node)).norm(),
              1e-12);
  const Eigen::VectorXd linear = turned.linear * (turned.to_unit * at_contact);
  EXPECT_LE((field_at(remainder, at_contact) + linear - actual).norm(), 1e-12);
}

TEST(SiteWeights, ReproduceLinearFunctionsAlongTheSurface) {
  const std::vector<Eigen::Vector3d> places = {{0, 0, 0},     {1, 0.1, 0},    {0.2, 1, 0},
                                               {-1, -0.3, 0}, {0.4, -1.2, 0}, {2, 2, 0}};
  const Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  std::vector<double> before;
  for (double x = -0.2; x <= 0.6; x += 0.01) {
    const Eigen::Vector3d contact(x, 0.2, 0);
    const std::vector<double> weights = site_weights(places, contact, normal);
    double sum = 0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < places.size(); ++i) {
      sum += weights[i];
      mean += weights[i] * places[i];
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_LE((mean - contact).norm(), 0.02);
    EXPECT_EQ(weights.back(), 0) << "the farthest one ends the support";
    for (size_t i = 0; i < before.size(); ++i) EXPECT_LE(std::abs(weights[i] - before[i]), 0.1);
    before = weights;
  }
  const std::vector<double> at_a_site = site_weights(places, places[2], normal);
  for (size_t i = 0; i < places.size(); ++i) EXPECT_NEAR(at_a_site[i], i == 2 ? 1 : 0, 1e-6);
}

}  // namespace affine_site_test
}  // namespace palpate::test
