// The surface point nearest to a tool, compared with all primitives in long double. The sign, compared with
// solid angles.
#include <gtest/gtest.h>

#include "tests/support/surface_bvh_fixture.hpp"

namespace palpate::test::surface_bvh_fixture {
namespace surface_bvh_test {

// The top of a block, with a boundary.
const TouchableSurface& block_top() {
  static const Model model = tetrahedral_block({});
  static const TouchableSurface surface(model, nodes_on_plane(model, 2, 1.0));
  return surface;
}

// Ten-node elements with curved edges: small, oblique triangles.
const TouchableSurface& curved_block() {
  static const TouchableSurface surface(with_middle_nodes(tetrahedral_block({}), 0.02));
  return surface;
}

// ---- Positions

// Positions around, far from, on and near the surface: corners, points of edges and faces.
std::vector<Vector3d> positions_around(const TouchableSurface& surface, int count, unsigned seed) {
  TestRandom random(seed);
  const Eigen::AlignedBox3d box = box_of(surface);
  const double size = size_of(surface);
  std::vector<Vector3d> positions;
  for (int i = 0; i < count; ++i) {
    const auto primitive = static_cast<std::size_t>((random() + 1) / 2 * static_cast<double>(surface.size()));
    const auto& sites = surface.bvh.primitives[primitive];
    double u = (random() + 1) / 2;
    double v = (1 - u) * (random() + 1) / 2;
    if (i % 5 == 1) v = 0;      // on an edge
    if (i % 5 == 2) u = v = 0;  // at a corner
    const Vector3d on =
        u * surface.site(sites[0]) + v * surface.site(sites[1]) + (1 - u - v) * surface.site(sites[2]);
    switch (i % 7) {
      case 0:
        positions.push_back(on);
        break;
      case 1:
      case 2:
        positions.push_back(on + std::pow(10.0, 4 * random() - 4) * size * random.vector());
        break;
      case 3:
        positions.push_back(on + 0.03 * size * random.vector());
        break;
      case 4:
        positions.push_back(box.center() + std::pow(10.0, 2 + 2 * random()) * size * random.vector());
        break;
      default:
        positions.push_back(box.center() + 0.7 * box.sizes().cwiseProduct(random.vector()));
    }
  }
  return positions;
}

class SurfaceBvhOf : public ::testing::TestWithParam<const TouchableSurface& (*)()> {
 protected:
  const TouchableSurface& surface_ = GetParam()();
};

INSTANTIATE_TEST_SUITE_P(Surfaces, SurfaceBvhOf,
                         ::testing::Values(block, block_top, single_sites, curved_block, brain));

TEST_P(SurfaceBvhOf, NearestPointIsThatOfAllPrimitives) {
  const double size = size_of(surface_);
  const int count = (surface_.size() > 1000 ? 1500 : 5000) / (kSanitized ? 5 : 1);
  for (const Vector3d& position : positions_around(surface_, count, 7)) {
    const SurfaceHit hit = nearest(surface_.pack, position);
    const double expected = brute_force(surface_.pack, position);
    ASSERT_NEAR(std::abs(hit.distance), expected, kTolerance * (size + expected)) << position.transpose();
    expect_consistent(surface_.pack, position, hit, size);
  }
}

TEST_P(SurfaceBvhOf, StartDoesNotChangeTheAnswer) {
  TestRandom random(8);
  uint32_t last = 0;
  for (const Vector3d& position : positions_around(surface_, 2000, 9)) {
    const SurfaceHit hit = nearest(surface_.pack, position);
    const auto any = static_cast<uint32_t>((random() + 1) / 2 * static_cast<double>(surface_.size()));
    for (const uint32_t start : {last, hit.primitive, any, surface_.pack.num_primitives, 0xffffffffU})
      expect_same(nearest(surface_.pack, position, start), hit);
    last = hit.primitive;
  }
}

TEST_P(SurfaceBvhOf, TreeIsWholeAndReachesEverySite) {
  EXPECT_TRUE(is_surface_tree(surface_.pack));
  std::vector<char> touched(surface_.sites.sites.size(), 0);
  for (const auto& corners : surface_.bvh.primitives) {
    for (const uint32_t site : corners) touched[site] = 1;
  }
  EXPECT_EQ(std::count(touched.begin(), touched.end(), 0), 0);
  for (uint32_t site = 0; site < touched.size(); ++site) {
    const SurfaceHit hit = nearest(surface_.pack, surface_.site(site));
    EXPECT_EQ(hit.distance, 0);
    const auto at = static_cast<std::size_t>(std::max_element(hit.weights, hit.weights + 3) - hit.weights);
    EXPECT_EQ(hit.weights[at], 1);
    EXPECT_EQ(hit.sites[at], site);
    // The first of all primitives at the site.
    for (uint32_t before = 0; before < hit.primitive; ++before) {
      for (const uint32_t corner : surface_.bvh.primitives[before]) EXPECT_NE(corner, site);
    }
  }
}

// Solid angle of the surface, over that of a sphere: van Oosterom and Strackee 1983.
double winding_number(const TouchableSurface& surface, const Model& model, const Vector3d& position) {
  double angle = 0;
  for (const auto& triangle : surface.surface.triangles) {
    std::array<Vector3d, 3> r;
    for (std::size_t k = 0; k < 3; ++k)
      r[k] = model.positions[static_cast<std::size_t>(triangle[k])] - position;
    const double a = r[0].norm();
    const double b = r[1].norm();
    const double c = r[2].norm();
    angle += 2 * std::atan2(r[0].dot(r[1].cross(r[2])),
                            a * b * c + r[0].dot(r[1]) * c + r[0].dot(r[2]) * b + r[1].dot(r[2]) * a);
  }
  return angle / (4 * std::numbers::pi);
}

void expect_signs(const Model& model, int count, int& inside) {
  const TouchableSurface whole(model);
  const TouchableSurface part(model, [&] {
    std::vector<int> upper;
    const double middle = box_of(whole).center().z();
    for (const int node : whole.surface.nodes) {
      if (model.positions[static_cast<std::size_t>(node)].z() > middle) upper.push_back(node);
    }
    return upper;
  }());
  const double size = size_of(whole);
  inside = 0;
  int shared = 0;
  for (const Vector3d& position : positions_around(whole, count, 10)) {
    const SurfaceHit hit = nearest(whole.pack, position);
    if (std::abs(hit.distance) < 1e-10 * size) continue;
    const bool is_inside = winding_number(whole, model, position) > 0.5;
    inside += is_inside;
    ASSERT_EQ(hit.distance < 0, is_inside) << position.transpose() << ", distance " << hit.distance;
    const SurfaceHit of_part = nearest(part.pack, position);
    if (std::abs(of_part.distance) > std::abs(hit.distance) + 1e-10 * size) continue;
    ++shared;
    ASSERT_EQ(of_part.distance < 0, is_inside) << position.transpose();
  }
  EXPECT_GT(shared, count / 5);
}

TEST(SurfaceBvh, SignTellsInsideFromOutside) {
  int inside = 0;
  expect_signs(tetrahedral_block({}), 4000, inside);
  EXPECT_GT(inside, 800);
  expect_signs(with_middle_nodes(tetrahedral_block({}), 0.02), 4000, inside);
  EXPECT_GT(inside, 800);
  expect_signs(read_inp(std::filesystem::path(PALPATE_SOURCE_DIR) / "models/brain/brain.inp"), 1500, inside);
  EXPECT_GT(inside, 300);
}

// A block with a groove. Around the groove the nearest point is often on a reflex edge or corner, where a
// face's own normal has the wrong sign.
TEST(SurfaceBvh, SignIsRightAtReflexEdges) {
  Model model = tetrahedral_block({{4, 4, 4}, {1, 1, 1}, 0.0, 1, CompressibleNeoHookean{0.48, 0.2}});
  std::erase_if(model.elements, [&](const Tetrahedron& element) {
    Vector3d centre = Vector3d::Zero();
    for (const int node : element.nodes()) centre += model.positions[static_cast<std::size_t>(node)] / 4;
    return centre.x() > 0.25 && centre.x() < 0.75 && centre.y() < 0.75 && centre.z() > 0.5;
  });
  int inside = 0;
  expect_signs(model, 4000, inside);
  EXPECT_GT(inside, 500);
}

// Baerentzen and Aanaes 2005: at a corner of a cube the three sides count alike, however they are
// triangulated.
TEST(SurfaceBvh, NormalsOfABlockAreThoseOfACube) {
  const double third = 1 / std::sqrt(3.0);
  const double half = 1 / std::sqrt(2.0);
  const auto normal_at = [](const TouchableSurface& surface, const Vector3d& position) {
    return Vector3d(nearest(surface.pack, position).normal);
  };
  const double kFloat = 1e-7;
  for (const TouchableSurface* surface : {&block(), &block_top()}) {
    EXPECT_LE((normal_at(*surface, {0.4, 0.5, 1.5}) - Vector3d::UnitZ()).norm(), kFloat);
    EXPECT_LE((normal_at(*surface, {2, 2, 2}) - Vector3d(third, third, third)).norm(), kFloat);
    EXPECT_LE((normal_at(*surface, {-2, 2, 2}) - Vector3d(-third, third, third)).norm(), kFloat);
    EXPECT_LE((normal_at(*surface, {2, 0.4, 2}) - Vector3d(half, 0, half)).norm(), kFloat) << "an edge";
  }
  // A single site has its vertex normal.
  EXPECT_LE((normal_at(single_sites(), {-1, -1, -1}) - Vector3d(-third, -third, -third)).norm(), kFloat);
}

TEST(SurfaceBvh, ASearchVisitsFewPrimitives) {
  TestRandom random(14);
  const TouchableSurface& surface = brain();
  const double size = size_of(surface);
  double nodes = 0;
  double primitives = 0;
  constexpr int kSearches = 1000;
  for (int i = 0; i < kSearches; ++i) {
    const auto primitive = static_cast<uint32_t>((random() + 1) / 2 * static_cast<double>(surface.size()));
    const Vector3d position =
        surface.site(surface.bvh.primitives[primitive][0]) + 0.02 * size * random.vector();
    SurfaceHit hit;
    SurfaceVisits visits;
    ASSERT_TRUE(find_nearest_surface_point(surface.pack, position.data(), primitive, hit, &visits));
    nodes += visits.nodes;
    primitives += visits.primitives;
  }
  EXPECT_LT(nodes / kSearches, 60);
  EXPECT_LT(primitives / kSearches, 30);
}

TEST(SurfaceBvh, SameSurfaceSameBytes) {
  const TouchableSurface again(tetrahedral_block({}));
  ASSERT_EQ(again.size(), block().size());
  ASSERT_EQ(again.bvh.nodes.size(), block().bvh.nodes.size());
  EXPECT_EQ(std::memcmp(again.bvh.nodes.data(), block().bvh.nodes.data(), 32 * again.bvh.nodes.size()), 0);
  EXPECT_EQ(again.bvh.primitives, block().bvh.primitives);
  EXPECT_EQ(again.bvh.primitive_normals, block().bvh.primitive_normals);
  EXPECT_EQ(again.bvh.site_normals, block().bvh.site_normals);
}

}  // namespace surface_bvh_test
}  // namespace palpate::test::surface_bvh_fixture
