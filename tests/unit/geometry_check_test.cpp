// Unjoined geometry: each kind is found where it was made, with the right number, and nowhere else.
#include "offline/mesh/geometry_check.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "offline/mesh/flat_triangle.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "offline/mesh/point_groups.hpp"
#include "tests/support/hard_scenes.hpp"
#include "tests/support/stacked_blocks.hpp"

namespace palpate {
namespace geometry_check_test {

using test::block_at;
using test::hollow_block;
using test::stacked_blocks;
using test::tetrahedral_block;
using test::with_part;

// The numbers of coincident nodes, faces on faces, hanging nodes, and overlapping elements.
std::array<std::size_t, 4> counts(const Model& model) {
  const UnjoinedGeometry found = find_unjoined(model);
  EXPECT_TRUE(found.is_complete);
  return {found.nodes.size(), found.faces.size(), found.hanging.size(), found.overlaps.size()};
}

constexpr std::array<std::size_t, 4> kNone = {0, 0, 0, 0};

// Single linkage by comparing every point with every other.
std::vector<int> slow_groups(const std::vector<Eigen::Vector3d>& points, double length) {
  std::vector<int> groups(points.size());
  for (std::size_t i = 0; i < groups.size(); ++i) groups[i] = static_cast<int>(i);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if ((points[i] - points[j]).norm() >= length) continue;
      const auto [low, high] = std::minmax({groups[i], groups[j]});
      for (int& group : groups) group = group == high ? low : group;
    }
  }
  return groups;
}

TEST(PointGroups, AreThoseOfAllPairs) {
  test::TestRandom random(7);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 600; ++i) points.push_back(random.vector());
  for (int i = 0; i < 100; ++i) points.push_back(points[static_cast<std::size_t>(3 * i)]);
  std::size_t most_groups = 0;
  for (const double length : {1e-9, 0.02, 0.08, 0.15, 0.25, 4.0}) {
    const std::vector<int> groups = group_points(points, length);
    EXPECT_EQ(groups, slow_groups(points, length)) << length;
    std::vector<int> distinct = groups;
    std::sort(distinct.begin(), distinct.end());
    distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
    most_groups = std::max(most_groups, distinct.size());
  }
  EXPECT_EQ(most_groups, 600U);
}

// All pairs of these points would take minutes.
TEST(PointGroups, OfPointsAtOnePlaceCostLittle) {
  std::vector<Eigen::Vector3d> points(300000, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(group_points(points, 1e-6), std::vector<int>(points.size(), 0));
  test::TestRandom random(3);
  for (Eigen::Vector3d& point : points) point += 2e-6 * random.vector();
  EXPECT_EQ(group_points(points, 1e-6), std::vector<int>(points.size(), 0));
}

TEST(FlatTriangle, KnowsCommonAreas) {
  const std::array<Eigen::Vector3d, 3> corners = {Eigen::Vector3d(0, 0, 1), {1, 0, 1}, {0, 1, 1}};
  const auto moved = [&](double factor, const Eigen::Vector3d& by) {
    std::array<Eigen::Vector3d, 3> result;
    for (std::size_t i = 0; i < 3; ++i)
      result[i] = by + factor * corners[i] + Eigen::Vector3d(0, 0, 1 - factor);
    return FlatTriangle(result);
  };
  const FlatTriangle triangle(corners);
  EXPECT_NEAR(common_area(triangle, moved(1, {0, 0, 0})), 0.5, 1e-15);
  EXPECT_NEAR(common_area(triangle, moved(1, {0.5, 0, 0})), 0.125, 1e-15);
  EXPECT_NEAR(common_area(triangle, moved(0.25, {0.1, 0.1, 0})), 0.5 / 16, 1e-15);
  EXPECT_NEAR(common_area(moved(0.25, {0.1, 0.1, 0}), triangle), 0.5 / 16, 1e-15);
  // The reflection about the centroid has a hexagon of two thirds in common.
  EXPECT_NEAR(common_area(triangle, moved(-1, {2.0 / 3, 2.0 / 3, 0})), 1.0 / 3, 1e-15);
  EXPECT_EQ(common_area(triangle, moved(1, {2, 0, 0})), 0);
}

TEST(UnjoinedGeometry, FindsPartsWithTheirOwnNodes) {
  Model model = stacked_blocks();
  // 4 x 4 nodes, and two faces on each of 3 x 3 squares, from both sides.
  const std::array<std::size_t, 4> expected = {16, 36, 0, 0};
  EXPECT_EQ(counts(model), expected);
  const UnjoinedGeometry found = find_unjoined(model);
  for (const CoincidentNode& pair : found.nodes) {
    EXPECT_EQ(model.positions[static_cast<std::size_t>(pair.node)],
              model.positions[static_cast<std::size_t>(pair.other)]);
  }
  EXPECT_TRUE(std::all_of(found.faces.begin(), found.faces.end(),
                          [](const FaceOnFace& face) { return face.coincident; }));
  model.file = "organ.inp";
  const std::vector<std::string> messages = unjoined_messages(model, found);
  ASSERT_EQ(messages.size(), 2U);
  EXPECT_EQ(messages[0],
            "organ.inp: 16 nodes lie at the place of another node that no element joins to it: the first is "
            "node 1001 of element 109, at node 33 of element 58; join them with --merge 1e-6 (in a scene: "
            "merge = 1e-6)");
  EXPECT_EQ(messages[1].substr(0, 84),
            "organ.inp: 36 outer faces lie on outer faces of other elements and are not joined: t");
  EXPECT_EQ(unjoined_counts(found), "16 nodes at the place of others, 36 faces on faces");
}

// Turned, in other units, away from the origin, and one part through float32 coordinates.
TEST(UnjoinedGeometry, DoesNotDependOnUnitsOrDigits) {
  const Eigen::Matrix3d turn = test::rotation_about({1, 2, 3}, 0.7);
  for (const double scale : {1e-6, 1.0, 25.4, 1e6}) {
    Model model = stacked_blocks();
    for (Eigen::Vector3d& position : model.positions)
      position = scale * (turn * position + Eigen::Vector3d(100, -50, 20));
    const std::array<std::size_t, 4> expected = {16, 36, 0, 0};
    EXPECT_EQ(counts(model), expected) << scale;
    for (std::size_t node = 48; node < model.positions.size(); ++node)
      model.positions[node] = model.positions[node].cast<float>().cast<double>();
    EXPECT_EQ(counts(model), expected) << scale << ", float32";
    const double length = find_unjoined(model).merge_length;
    EXPECT_GT(length, scale * 1e-6);
    EXPECT_LT(length, scale * 1e-3);
  }
}

TEST(UnjoinedGeometry, FindsInterfacesThatDoNotMatch) {
  const Model model =
      with_part(block_at({0, 0, 0}, {2, 2, 2}, {1, 1, 1}), block_at({0, 0, 1}, {3, 3, 3}, {1, 1, 1}));
  const UnjoinedGeometry found = find_unjoined(model);
  // Only the four corners coincide. 3 x 3 and 4 x 4 nodes lie at the interface.
  const std::array<std::size_t, 4> expected = {4, 2 * 4 + 2 * 9, 9 - 4 + 16 - 4, 0};
  EXPECT_EQ(counts(model), expected);
  EXPECT_TRUE(std::none_of(found.faces.begin(), found.faces.end(),
                           [](const FaceOnFace& face) { return face.coincident; }));
  for (const HangingNode& hanging : found.hanging)
    EXPECT_EQ(model.positions[static_cast<std::size_t>(hanging.node)].z(), 1);
}

// A node in the middle of an edge that the elements on the other side do not have.
TEST(UnjoinedGeometry, FindsAHangingNode) {
  Model model = block_at({0, 0, 0}, {1, 1, 1}, {1, 1, 1});
  // Cuts the elements about the diagonal of the base, 1 4, except one of them.
  const int middle = model.num_nodes();
  model.positions.emplace_back(0.5, 0.5, 0);
  model.labels.push_back(9);
  const Tetrahedron whole = model.elements.front();  // nodes 0 1 3 7, with the edge 0 3
  model.elements.front().node_array = {0, 1, middle, 7};
  Tetrahedron half = whole;
  half.label = 7;
  half.node_array = {middle, 1, 3, 7};
  model.elements.push_back(half);
  const UnjoinedGeometry found = find_unjoined(model);
  ASSERT_EQ(found.hanging.size(), 1U);
  EXPECT_EQ(found.hanging.front().node, middle);
  EXPECT_EQ(model.elements[static_cast<std::size_t>(found.hanging.front().face.element)].label, 2);
  EXPECT_EQ(found.nodes.size(), 0U);
  EXPECT_EQ(found.faces.size(), 3U) << "a whole face, on two halves";
  EXPECT_EQ(found.overlaps.size(), 0U);
}

TEST(UnjoinedGeometry, FindsABodyInsideABody) {
  const Model model = with_part(block_at({0, 0, 0}, {3, 3, 3}, {3, 3, 3}),
                                block_at({0.71, 0.72, 0.73}, {1, 1, 1}, {0.1, 0.1, 0.1}));
  const std::array<std::size_t, 4> expected = {0, 0, 0, 6};
  EXPECT_EQ(counts(model), expected);
}

// The inner elements lie exactly on elements of the outer body.
TEST(UnjoinedGeometry, FindsElementsThatAreThereTwice) {
  const Model model =
      with_part(block_at({0, 0, 0}, {3, 3, 3}, {3, 3, 3}), block_at({1, 1, 1}, {1, 1, 1}, {1, 1, 1}));
  const std::array<std::size_t, 4> expected = {8, 0, 0, 6};
  EXPECT_EQ(counts(model), expected);
}

// Two bars that cross: no node and no centroid lies in an element of the other.
TEST(UnjoinedGeometry, FindsBodiesThatCross) {
  const Model model = with_part(block_at({-2, -0.1, -0.1}, {1, 1, 1}, {4, 0.2, 0.2}),
                                block_at({0.35, -1.6, -0.08}, {1, 1, 1}, {0.15, 4, 0.16}));
  EXPECT_GT(find_unjoined(model).overlaps.size(), 0U);
  EXPECT_EQ(counts(with_part(block_at({-2, -0.1, -0.1}, {1, 1, 1}, {4, 0.2, 0.2}),
                             block_at({0.35, -1.6, 0.11}, {1, 1, 1}, {0.15, 4, 0.16}))),
            kNone);
}

// Faces that lie on each other and look the same way belong to bodies that overlap, not to bodies that touch.
TEST(UnjoinedGeometry, TellsOverlapsFromContacts) {
  const Model block = block_at({0, 0, 0}, {2, 1, 1}, {2, 1, 1});
  const UnjoinedGeometry overlapping =
      find_unjoined(with_part(block, block_at({0.6, 0, 0}, {2, 1, 1}, {2, 1, 1})));
  EXPECT_EQ(overlapping.faces.size(), 0U);
  EXPECT_GT(overlapping.overlaps.size(), 0U);
  const UnjoinedGeometry touching =
      find_unjoined(with_part(block, block_at({2, 0.6, 0.6}, {2, 1, 1}, {2, 1, 1})));
  EXPECT_GT(touching.faces.size(), 0U);
  EXPECT_EQ(touching.overlaps.size(), 0U);
}

TEST(UnjoinedGeometry, IsNotFoundInSoundMeshes) {
  for (const char* file : {"brain/brain.inp", "cylinder/cylinder.inp", "arch/arch.inp"})
    EXPECT_EQ(counts(read_inp(std::filesystem::path(PALPATE_SOURCE_DIR) / "models" / file)), kNone) << file;
  for (unsigned seed = 1; seed < 9; ++seed) {
    test::BlockShape shape;
    shape.cells = {4, 3, 5};
    shape.seed = seed;
    const Model block = tetrahedral_block(shape);
    EXPECT_EQ(counts(block), kNone) << seed;
    EXPECT_EQ(counts(test::with_middle_nodes(block, 0.02)), kNone) << seed;
  }
  EXPECT_EQ(counts(hollow_block()), kNone);
}

// Bodies at a distance, and a body in the hollow of another, 0.001 of an edge from its wall.
TEST(UnjoinedGeometry, IsNotFoundBetweenBodiesApart) {
  EXPECT_EQ(counts(with_part(block_at({0, 0, 0}, {3, 3, 2}, {3, 3, 2}),
                             block_at({0, 0, 2.001}, {3, 3, 2}, {3, 3, 2}))),
            kNone);
  EXPECT_EQ(
      counts(with_part(hollow_block(), block_at({1.001, 1.001, 1.001}, {1, 1, 1}, {0.998, 0.998, 0.998}))),
      kNone);
}

// The sliver's node lies 2e-7 beside an edge of its neighbour, or above a face.
TEST(UnjoinedGeometry, IsNotFoundInSlivers) {
  for (const double flatness : {1e-2, 1e-4, 1e-6})
    EXPECT_EQ(counts(test::block_with_slivers(flatness)), kNone) << flatness;
  // A membrane of one layer, whose edges are 30,000 times as long as it is thick.
  EXPECT_EQ(counts(block_at({0, 0, 0}, {4, 3, 1}, {1.2, 0.9, 1e-5})), kNone);
  Model model = block_at({0, 0, 0}, {1, 1, 1}, {1, 1, 1});
  model.elements.resize(1);  // nodes 0 1 3 7: the corners (0,0,0), (1,0,0), (1,1,0), (1,1,1)
  const auto with_sliver = [&](const Eigen::Vector3d& place, const std::array<int, 3>& base) {
    Model result = model;
    result.positions.push_back(place);
    result.labels.push_back(9);
    Tetrahedron sliver = result.elements.front();
    sliver.label = 2;
    sliver.node_array = {base[0], base[1], base[2], 8};
    result.elements.push_back(sliver);
    return result;
  };
  EXPECT_EQ(counts(with_sliver({0.4, 0.3, -2e-7}, {0, 3, 1})), kNone);
  EXPECT_EQ(counts(with_sliver({0.4, 0.4 + 2e-7, 2e-7}, {0, 7, 3})), kNone);
  EXPECT_EQ(counts(with_sliver({1 + 2e-7, 1 + 1e-7, 2e-7}, {1, 3, 7})), kNone);
}

// Elements that lie all in each other: the search ends although every one meets every other.
TEST(UnjoinedGeometry, OfAHeapIsFoundSoon) {
  const Model cell = block_at({0, 0, 0}, {1, 1, 1}, {1, 1, 1});
  Model heap = cell;
  heap.positions.clear();
  heap.labels.clear();
  heap.elements.clear();
  test::TestRandom random(1);
  constexpr int kElements = 5000;
  for (int i = 0; i < kElements; ++i) {
    Tetrahedron element;
    element.label = i + 1;
    for (std::size_t a = 0; a < 4; ++a) {
      element.node_array[a] = heap.num_nodes();
      heap.labels.push_back(heap.num_nodes() + 1);
      const Eigen::Vector3d& corner = cell.positions[std::array<std::size_t, 4>{0, 1, 3, 7}[a]];
      heap.positions.push_back(i % 2 == 0 ? corner : Eigen::Vector3d(corner + 0.1 * random.vector()));
    }
    heap.elements.push_back(element);
  }
  EXPECT_GT(find_unjoined(heap).overlaps.size(), kElements / 2U);

  // Needles side by side along a diagonal: the box of each meets all others, and they do not touch. All pairs
  // would take a minute.
  for (int i = 0; i < kElements; ++i) {
    const Eigen::Vector3d from = 0.1 * Eigen::Vector3d(i % 70, -i % 70, i / 70);
    const std::array<Eigen::Vector3d, 4> corners = {
        Eigen::Vector3d(0, 0, 0), {1e4, 1e4, 1e4}, {0, 0.05, 0}, {0, 0, 0.05}};
    for (std::size_t a = 0; a < 4; ++a)
      heap.positions[4 * static_cast<std::size_t>(i) + a] = from + corners[a];
  }
  const UnjoinedGeometry needles = find_unjoined(heap);
  EXPECT_FALSE(needles.is_complete);
  EXPECT_FALSE(needles.empty());
  EXPECT_EQ(unjoined_messages(heap, needles).size(), 1U);
}

}  // namespace geometry_check_test
}  // namespace palpate
