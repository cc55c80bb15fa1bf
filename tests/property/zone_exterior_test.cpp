// The exterior's nonlinear terms, compared with the full solve.
#include "offline/precompute/zone_exterior.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/rigid_patch.hpp"
#include "schemas/monomials.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate::test {
namespace zone_exterior_test {

struct Outside {
  double left_out = 0;  // |q - its series|
  double all = 0;       // |q|
};

// A block with a zone of one ring about each site.
class ZoneExterior : public testing::Test {
 protected:
  explicit ZoneExterior(const Law& law = CompressibleNeoHookean{1.0, 4.0}) : block(block_of(law)) {}

  ZoneTables tables(int degree) {
    ZoneTables zone = find_zones(block.scene, block.model, block.sites, 1);
    zone.exterior_degree = degree;
    compute_zone_exterior(assembly, block.sites, {}, block.scene.max_displacement, 2, {}, zone);
    return zone;
  }

  // q = -K^-1 n_X(u) of the full solve for a push, and the exterior's series at the force of the same push.
  Outside outside(const ZoneTables& zone, size_t site_index, const Eigen::Vector3d& push) {
    const Model& model = block.model;
    const ContactSite& site = block.sites.sites[site_index];
    LoadCase rest = LoadCase::rest(model);
    LoadCase load = rest;
    for (const int node : site.patch_nodes) {
      for (int axis = 0; axis < 3; ++axis) {
        rest.held[static_cast<size_t>(3 * node + axis)] = load.held[static_cast<size_t>(3 * node + axis)] = 1;
        load.displacement[3 * node + axis] = push[axis];
      }
    }
    StaticSolver solver(assembly);
    SolverSettings settings;
    settings.residual_tolerance = 1e-12;
    Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
    EXPECT_TRUE(solver.ramp(rest, load, u, settings).converged);

    Eigen::VectorXd internal;
    assembly.internal_force(u, internal);
    Eigen::Vector3d x = Eigen::Vector3d::Zero();
    for (const int node : site.patch_nodes) x += internal.segment<3>(3 * node) / zone.force_scale[site_index];

    Model beyond = model;
    const std::vector<int> inside = ZoneFinder(model).elements_about(site, 1);
    beyond.elements.clear();
    for (size_t e = 0; e < model.elements.size(); ++e) {
      if (!std::binary_search(inside.begin(), inside.end(), static_cast<int>(e)))
        beyond.elements.push_back(model.elements[e]);
    }
    const Assembly of_beyond(beyond, beyond.fixed_dofs());
    const Eigen::VectorXd nowhere = Eigen::VectorXd::Zero(u.size());
    of_beyond.internal_force(u, internal);
    Eigen::MatrixXd q = of_beyond.tangent_times(nowhere, u) - internal;
    factor_at_rest(solver, {});
    solve_at_rest(solver, q);

    std::vector<double> monomials(pack::num_monomials(0, static_cast<uint32_t>(zone.exterior_degree)));
    pack::evaluate_monomials(x.data(), static_cast<uint32_t>(zone.exterior_degree), monomials.data());
    const Eigen::MatrixXd fields = zone.exterior[site_index].cast<double>();
    const Eigen::Map<const Eigen::VectorXd> powers(monomials.data() + pack::monomial_start(2), fields.cols());
    const Eigen::VectorXd rows = q(exterior_dofs(block.sites, zone), 0);
    return {(rows - fields * powers).norm(), rows.norm()};
  }

  static TouchedBlock block_of(const Law& law) {
    TouchedBlock block = touched_block(4, 0.26);
    block.model.materials.front().law = law;
    show_every_node(block);
    return block;
  }

  TouchedBlock block;
  Assembly assembly{block.model, block.model.fixed_dofs()};
};

// Half the push leaves an error smaller by 2^(degree + 1).
TEST_F(ZoneExterior, IsThatOfTheFullSolveToItsDegree) {
  const Eigen::Vector3d push = Eigen::Vector3d(0.4, -0.3, -0.7).normalized();
  for (int degree = 3; degree <= 5; ++degree) {
    SCOPED_TRACE(degree);
    const ZoneTables zone = tables(degree);
    for (const size_t site : {0, 4, 7}) {
      const Outside whole = outside(zone, site, 0.05 * push);
      const Outside half = outside(zone, site, 0.025 * push);
      EXPECT_LT(half.left_out, 0.05 * half.all);
      EXPECT_NEAR(std::log2(whole.left_out / half.left_out), degree + 1, 0.5);
    }
  }
}

// The scene's target widens zones, and only beyond the highest degree.
TEST_F(ZoneExterior, ZonesAreWidenedWhereThatLeavesTooMuch) {
  const auto num_wider = [&](double target, int degree) {
    Scene scene = block.scene;
    scene.accuracy_target = target;
    ZoneTables zone = find_zones(scene, block.model, block.sites, 1);
    zone.exterior_degree = degree;
    zone = widen_zones(assembly, scene, block.sites, {}, 2, {}, zone);
    EXPECT_EQ(zone.rings, 1);
    return std::count(zone.more_rings.begin(), zone.more_rings.end(), 1);
  };
  const auto all = static_cast<std::ptrdiff_t>(block.sites.sites.size());
  EXPECT_EQ(num_wider(1.0, 5), 0);
  EXPECT_EQ(num_wider(1e-9, 5), all);
  EXPECT_EQ(num_wider(1e-9, 4), 0);
  std::ptrdiff_t before = 0;
  bool some = false;
  for (double target = 1; target > 1e-8; target /= 1.2) {
    const std::ptrdiff_t count = num_wider(target, 5);
    EXPECT_GE(count, before) << "the finer the target, the more";
    some = some || (count > 0 && count < all);
    before = count;
    if (count == all) break;
  }
  EXPECT_TRUE(some) << "sites differ";
}

class LinearExterior : public ZoneExterior {
 protected:
  LinearExterior() : ZoneExterior(LinearElastic{1.0, 2.0}) {}
};

// Exactly zero, so a pack of a linear organ stores no interaction terms.
TEST_F(LinearExterior, AddsNothing) {
  for (const auto& fields : tables(5).exterior) EXPECT_TRUE(fields.isZero(0));
}

}  // namespace zone_exterior_test
}  // namespace palpate::test
