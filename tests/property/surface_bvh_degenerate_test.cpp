// Nearest points on triangles without area, single sites, far positions and deep trees.
#include <gtest/gtest.h>

#include "tests/support/surface_bvh_fixture.hpp"

namespace palpate::test::surface_bvh_fixture {
namespace surface_bvh_degenerate_test {

TEST(SurfaceBvh, ASiteAloneIsAPrimitive) {
  const TouchableSurface& surface = single_sites();
  ASSERT_EQ(surface.size(), 5U);
  const SurfaceHit hit = nearest(surface.pack, {1.25, 1, 1});
  EXPECT_EQ(hit.sites[0], 4U);
  EXPECT_EQ(hit.sites[1], 4U);
  EXPECT_EQ(hit.sites[2], 4U);
  EXPECT_EQ(hit.distance, 0.25);
  EXPECT_LT(nearest(surface.pack, {0.9, 0.9, 0.9}).distance, 0);
  const TouchableSurface one(tetrahedral_block({}), {63});
  EXPECT_EQ(nearest(one.pack, {1, 1, 4}).distance, 3);
}

// ---- Hard cases

// Primitives of any shape, in a single leaf.
struct LooseTriangles {
  explicit LooseTriangles(const std::vector<Vector3d>& corners) {
    for (const Vector3d& corner : corners) {
      sites.push_back(static_cast<uint32_t>(sites.size()));
      positions.insert(positions.end(), corner.begin(), corner.end());
      box.extend(corner.cast<float>());
    }
    const auto count = static_cast<uint32_t>(sites.size());
    site_normals.assign(3 * sites.size(), 0);
    primitive_normals.assign(4 * sites.size(), 0);
    for (std::size_t i = 2; i < site_normals.size(); i += 3) site_normals[i] = 1;
    for (std::size_t i = 2; i < primitive_normals.size(); i += 3) primitive_normals[i] = 1;
    for (int i = 0; i < 3; ++i) {
      node.min[i] = box.min()[i] - 1e-6f * std::abs(box.min()[i]);
      node.max[i] = box.max()[i] + 1e-6f * std::abs(box.max()[i]);
    }
    node.count = count / 3;
    pack.num_sites = count;
    pack.positions = pack.rest_positions = positions.data();
    pack.site_nodes = sites.data();
    pack.num_primitives = count / 3;
    pack.num_bvh_nodes = 1;
    pack.primitives = sites.data();
    pack.bvh_nodes = &node;
    pack.primitive_normals = primitive_normals.data();
    pack.site_normals = site_normals.data();
  }

  std::vector<uint32_t> sites;
  std::vector<double> positions;
  std::vector<float> site_normals;
  std::vector<float> primitive_normals;
  Eigen::AlignedBox3f box;
  pack::BvhNode node = {};
  pal_pack pack = {};
};

TEST(SurfaceBvh, DegenerateTrianglesKeepTheirEdges) {
  const Vector3d o(0.3, -0.2, 0.1);
  const Vector3d e(0.6, 0.7, -0.4);
  const Vector3d f(-0.1, 0.9, 0.8);
  std::vector<std::array<Vector3d, 3>> triangles = {
      {o, o, o},         {o, o, e},         {o, e, o},         {e, o, o},
      {o, e, 2 * e - o}, {o, 2 * e - o, e}, {e, o, 2 * e - o}, {o, e, o + 0.3 * (e - o)}};
  for (const double height : {1e-3, 1e-6, 1e-9, 1e-11, 1e-12, 1e-13, 1e-15, 1e-18, 1e-300}) {
    triangles.push_back({o, e, o + 0.3 * (e - o) + height * f});  // a cap
    triangles.push_back({o, e, o - 0.3 * (e - o) + height * f});
    triangles.push_back({o, e, o + height * f});  // a needle
    triangles.push_back({o, o + height * f, e});
    triangles.push_back({o, o + height * e, o + height * f});  // a small triangle
  }
  TestRandom random(11);
  for (const auto& [a, b, c] : triangles) {
    const LooseTriangles loose({a, b, c});
    for (int i = 0; i < 600; ++i) {
      Vector3d position = o + std::pow(10.0, 6 * random()) * random.vector();
      if (i % 3 == 0) position = o + random() * (e - o) + std::pow(10.0, 7 * random() - 7) * random.vector();
      if (i < 6) position = i % 2 == 0 ? a : o + 0.2 * i * (e - o);
      const SurfaceHit hit = nearest(loose.pack, position);
      const double expected = brute_force(loose.pack, position);
      ASSERT_NEAR(std::abs(hit.distance), expected, kTolerance * (1 + expected))
          << (b - a).transpose() << " and " << (c - a).transpose() << " at " << position.transpose();
      expect_consistent(loose.pack, position, hit, 1);
    }
  }
}

// Small integers: lengths and heights are zero to the bit.
TEST(SurfaceBvh, TrianglesWithoutAreaAreAnsweredExactly) {
  const Vector3d x = Vector3d::UnitX();
  for (const auto& [a, b, c] : std::vector<std::array<double, 3>>{{0, 4, 8},
                                                                  {0, 8, 4},
                                                                  {4, 0, 8},
                                                                  {4, 8, 0},
                                                                  {8, 0, 4},
                                                                  {0, 0, 8},
                                                                  {0, 8, 0},
                                                                  {8, 0, 0},
                                                                  {0, 8, 8}}) {
    const LooseTriangles loose({a * x, b * x, c * x});
    for (double along = -2; along <= 10; ++along) {
      const SurfaceHit hit = nearest(loose.pack, {along, 3, 4});
      EXPECT_EQ(hit.point[0], std::clamp(along, 0.0, 8.0)) << a << ' ' << b << ' ' << c;
      const double beyond = along - hit.point[0];
      EXPECT_DOUBLE_EQ(hit.distance, std::sqrt(25 + beyond * beyond));
    }
  }
}

TEST(SurfaceBvh, AnyPositionIsAnsweredFinitelyOrRefused) {
  TestRandom random(12);
  for (const TouchableSurface* surface : {&block(), &single_sites(), &brain()}) {
    for (const double far : {1e3, 1e6, 1e9, 1e12, 1e15}) {
      for (int i = 0; i < 20; ++i) {
        const Vector3d position = far * random.vector();
        const SurfaceHit hit = nearest(surface->pack, position);
        EXPECT_NEAR(hit.distance, brute_force(surface->pack, position), kTolerance * far);
        expect_consistent(surface->pack, position, hit, size_of(*surface));
      }
    }
    const SurfaceHit untouched = {1, {2, 3, 4}, {5, 6, 7}, {8, 9, 10}, {11, 12, 13}, 14};
    SurfaceHit hit = untouched;
    for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1.1e15, -1e300}) {
      for (int axis = 0; axis < 3; ++axis) {
        Vector3d position = Vector3d::Zero();
        position[axis] = bad;
        EXPECT_FALSE(find_nearest_surface_point(surface->pack, position.data(), 0, hit)) << bad;
        expect_same(hit, untouched);
      }
    }
  }
}

// Tiny and huge organs: the extremes that a pack may hold.
TEST(SurfaceBvh, ExtremeTrianglesAreAnsweredFinitely) {
  TestRandom random(13);
  for (const double size : {1e-300, 1e-160, 1e-80, 1e-15, 1.0, 1e15}) {
    for (const double other : {1e-300, 1e-15, 1e15}) {
      const LooseTriangles loose({size * random.vector(), other * random.vector(), size * random.vector()});
      for (const double away : {0.0, 1e-300, 1e-15, 1.0, 1e15}) {
        const SurfaceHit hit = nearest(loose.pack, away * random.vector());
        EXPECT_TRUE(std::isfinite(hit.distance));
        for (int i = 0; i < 3; ++i) {
          EXPECT_TRUE(std::isfinite(hit.point[i]) && std::isfinite(hit.normal[i])) << size << ' ' << other;
          EXPECT_TRUE(hit.weights[i] >= 0 && hit.weights[i] <= 1) << size << ' ' << other << ' ' << away;
        }
      }
    }
  }
}

TEST(SurfaceBvh, WithoutATreeNothingIsFound) {
  const pal_pack none = {};
  const double position[3] = {0, 0, 0};
  SurfaceHit hit;
  EXPECT_FALSE(find_nearest_surface_point(none, position, 0, hit));
}

// Sites at growing distances: the cheapest split takes off a site at a time, and would go 56 deep.
TEST(SurfaceBvh, TreeIsNeverTooDeep) {
  for (const int axes : {1, 3}) {
    Model model;
    ContactSites sites;
    for (int i = 0; i < 60; ++i) {
      const double x = std::pow(16.0, i - 30);
      model.positions.emplace_back(x, axes > 1 ? x : 0, axes > 1 ? x : 0);
      ContactSite site;
      site.node = site.packed_node = i;
      sites.sites.push_back(site);
    }
    const SurfaceBvh bvh = build_surface_bvh(model, {}, sites);
    std::vector<uint32_t> depth(bvh.nodes.size(), 0);
    for (std::size_t i = 0; i < bvh.nodes.size(); ++i) {
      if (bvh.nodes[i].count > 0) continue;
      depth[i + 1] = depth[bvh.nodes[i].first] = depth[i] + 1;
    }
    EXPECT_LE(*std::max_element(depth.begin(), depth.end()), pack::kMostBvhDepth);
    EXPECT_TRUE(axes == 1 || *std::max_element(depth.begin(), depth.end()) >= pack::kMostBvhDepth - 2);
  }
}

}  // namespace surface_bvh_degenerate_test
}  // namespace palpate::test::surface_bvh_fixture
