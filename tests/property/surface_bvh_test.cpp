// The surface point nearest to a tool, against all primitives one by one in long double; its sign, against
// solid angles.
#include "runtime/src/pack/surface_bvh.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "offline/mesh/inp_reader.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/tetrahedral_block.hpp"
#include "tests/support/touchable_surface.hpp"

namespace palpate::test {
namespace {

using Eigen::Vector3d;
using Precise = Eigen::Matrix<long double, 3, 1>;

// Roundings of float64, of the distance plus the size of the surface.
constexpr double kTolerance = 1e-12;

// ---- Surfaces

const TouchableSurface& block() {
  static const TouchableSurface surface(tetrahedral_block({}));
  return surface;
}

// The top of a block, with a rim.
const TouchableSurface& block_top() {
  static const Model model = tetrahedral_block({});
  static const TouchableSurface surface(model, nodes_on_plane(model, 2, 1.0));
  return surface;
}

// Sites too far apart to make a triangle.
const TouchableSurface& single_sites() {
  static const TouchableSurface surface(tetrahedral_block({}), {0, 3, 10, 51, 63});
  return surface;
}

// Ten-node elements with curved edges: small, oblique triangles.
const TouchableSurface& curved_block() {
  static const TouchableSurface surface(with_middle_nodes(tetrahedral_block({}), 0.02));
  return surface;
}

const TouchableSurface& brain() {
  static const TouchableSurface surface(
      read_inp(std::filesystem::path(PALPATE_SOURCE_DIR) / "models/brain/brain.inp"));
  return surface;
}

Eigen::AlignedBox3d box_of(const TouchableSurface& surface) {
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < surface.positions.size(); i += 3) box.extend(Vector3d(&surface.positions[i]));
  return box;
}

double size_of(const TouchableSurface& surface) {
  return box_of(surface).diagonal().norm();
}

// ---- Answers

SurfaceHit nearest(const pal_pack& pack, const Vector3d& position, uint32_t start = 0) {
  SurfaceHit hit = {};
  EXPECT_TRUE(find_nearest_surface_point(pack, position.data(), start, hit));
  return hit;
}

// The nearest point of an edge, and of a triangle by its plane and edges, each on its own.
Precise nearest_on_edge(const Precise& p, const Precise& a, const Precise& b) {
  const Precise edge = b - a;
  const long double square = edge.squaredNorm();
  const long double t = square > 0 ? std::clamp((p - a).dot(edge) / square, 0.0L, 1.0L) : 0.0L;
  return a + t * edge;
}

long double distance_to(const Precise& p, const std::array<Precise, 3>& corners) {
  Precise offset = p - corners[0];  // from the nearest point of the edges
  for (std::size_t k = 0; k < 3; ++k) {
    const Precise other = p - nearest_on_edge(p, corners[k], corners[(k + 1) % 3]);
    if (other.norm() < offset.norm()) offset = other;
  }
  const Precise normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const bool over = normal.norm() > 0 && (corners[1] - corners[0]).cross(p - corners[0]).dot(normal) >= 0 &&
                    (corners[2] - corners[1]).cross(p - corners[1]).dot(normal) >= 0 &&
                    (corners[0] - corners[2]).cross(p - corners[2]).dot(normal) >= 0;
  return over ? std::abs(offset.dot(normal.normalized())) : offset.norm();
}

std::array<Precise, 3> corners_of(const pal_pack& pack, uint32_t primitive) {
  std::array<Precise, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) {
    const uint32_t node = pack.site_nodes[pack.primitives[3 * primitive + k]];
    corners[k] = Vector3d(pack.positions + 3 * node).cast<long double>();
  }
  return corners;
}

double brute_force(const pal_pack& pack, const Vector3d& position) {
  long double distance = std::numeric_limits<long double>::infinity();
  for (uint32_t primitive = 0; primitive < pack.num_primitives; ++primitive) {
    distance = std::min(distance, distance_to(position.cast<long double>(), corners_of(pack, primitive)));
  }
  return static_cast<double>(distance);
}

// What a hit says of itself.
void expect_consistent(const pal_pack& pack, const Vector3d& position, const SurfaceHit& hit, double size) {
  ASSERT_LT(hit.primitive, pack.num_primitives);
  const std::array<Precise, 3> corners = corners_of(pack, hit.primitive);
  Precise point = Precise::Zero();
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(hit.sites[k], pack.primitives[3 * hit.primitive + k]);
    EXPECT_GE(hit.weights[k], 0);
    sum += hit.weights[k];
    point += static_cast<long double>(hit.weights[k]) * corners[k];
  }
  EXPECT_NEAR(sum, 1, 1e-15);
  EXPECT_LE((point.cast<double>() - Vector3d(hit.point)).norm(),
            1e-15 * (size + point.cast<double>().norm()));
  const double distance = (Vector3d(hit.point) - position).norm();
  EXPECT_NEAR(distance, std::abs(hit.distance), kTolerance * (size + distance));
  EXPECT_NEAR(Vector3d(hit.normal).norm(), 1, 1e-15);
}

void expect_same(const SurfaceHit& a, const SurfaceHit& b) {
  EXPECT_EQ(a.primitive, b.primitive);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(a.sites[k], b.sites[k]);
    EXPECT_EQ(a.weights[k], b.weights[k]);
    EXPECT_EQ(a.point[k], b.point[k]);
    EXPECT_EQ(a.normal[k], b.normal[k]);
  }
  EXPECT_EQ(a.distance, b.distance);
}

// ---- Positions

// Around, far from and on the surface: its corners, points of its edges and faces, and a little off them.
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
    // Of all primitives at the site the first.
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

// A block with a groove: the nearest point of much of the air in it, and of much of the tissue around it, is
// a reflex edge or corner, where a face's own normal would guess wrong.
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

// Baerentzen and Aanaes 2005: at a corner of a cube, however it is cut into triangles, the three sides count
// alike.
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
  // A site alone has its vertex normal.
  EXPECT_LE((normal_at(single_sites(), {-1, -1, -1}) - Vector3d(-third, -third, -third)).norm(), kFloat);
}

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

// Primitives of any shape, in one leaf.
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

TEST(SurfaceBvh, DegenerateTrianglesAreAnsweredByWhatIsLeftOfThem) {
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
    triangles.push_back({o, o + height * e, o + height * f});  // all of it small
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

// Tiny and huge organs at once: the extremes of what a pack may say.
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

// Sites ever farther apart: the cheapest split takes off one at a time, and would go 56 deep.
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

}  // namespace
}  // namespace palpate::test
