// The outer surface of a mesh: triangles, neighbours, distances along the surface, normals.
#include "offline/mesh/surface.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace palpate {
namespace surface_test {

Model model_of(const std::vector<Eigen::Vector3d>& positions,
               const std::vector<std::array<int, 4>>& elements) {
  Model model;
  model.positions = positions;
  for (const std::array<int, 4>& nodes : elements) {
    Tetrahedron element;
    element.label = static_cast<int>(model.elements.size()) + 1;
    std::copy(nodes.begin(), nodes.end(), element.node_array.begin());
    model.elements.push_back(element);
  }
  return model;
}

// A unit cube of six tetrahedra around its diagonal, and a node without elements.
Model cube() {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(9);
  for (int corner = 0; corner < 8; ++corner) {
    positions.emplace_back(corner & 1, (corner >> 1) & 1, corner >> 2);
  }
  positions.emplace_back(9, 9, 9);
  return model_of(positions,
                  {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}});
}

TEST(Surface, ACubeHasTwelveTriangles) {
  const Model model = cube();
  const Surface surface = extract_surface(model);
  EXPECT_EQ(surface.triangles.size(), 12U);
  EXPECT_EQ(surface.nodes, (std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7}));
  // 12 edges of the cube, and a diagonal on each side.
  EXPECT_NEAR(surface.mean_edge, (12 + 6 * std::sqrt(2.0)) / 18, 1e-14);
  ASSERT_EQ(surface.neighbour_start.size(), 10U);
  EXPECT_EQ(surface.neighbour_start[9], 36);
  EXPECT_EQ(surface.neighbour_start[9], surface.neighbour_start[8]) << "no neighbours off the surface";
}

TEST(Surface, TrianglesTurnOutward) {
  const Model model = cube();
  const Eigen::Vector3d centre(0.5, 0.5, 0.5);
  double enclosed = 0;
  for (const auto& [a, b, c] : extract_surface(model).triangles) {
    const auto at = [&](int node) { return model.positions[static_cast<std::size_t>(node)]; };
    const Eigen::Vector3d normal = (at(b) - at(a)).cross(at(c) - at(a));
    EXPECT_GT(normal.dot(at(a) - centre), 0);
    enclosed += at(a).dot(at(b).cross(at(c))) / 6;
  }
  EXPECT_NEAR(enclosed, 1.0, 1e-14);
}

TEST(Surface, NeighboursAreMutualAndSorted) {
  const Surface surface = extract_surface(cube());
  const auto row = [&](int node) {
    const auto begin = surface.neighbours.begin() + surface.neighbour_start[static_cast<std::size_t>(node)];
    return std::vector<int>(
        begin, surface.neighbours.begin() + surface.neighbour_start[static_cast<std::size_t>(node) + 1]);
  };
  for (const int node : surface.nodes) {
    const std::vector<int> neighbours = row(node);
    EXPECT_TRUE(std::is_sorted(neighbours.begin(), neighbours.end()));
    for (const int other : neighbours) {
      const std::vector<int> back = row(other);
      EXPECT_TRUE(std::binary_search(back.begin(), back.end(), node));
    }
  }
}

TEST(Surface, DoesNotDependOnTheOrderOfElements) {
  Model model = cube();
  const Surface surface = extract_surface(model);
  std::reverse(model.elements.begin(), model.elements.end());
  const Surface again = extract_surface(model);
  EXPECT_EQ(surface.triangles.size(), again.triangles.size());
  EXPECT_EQ(surface.nodes, again.nodes);
  EXPECT_EQ(surface.neighbours, again.neighbours);
  EXPECT_EQ(surface.neighbour_distance, again.neighbour_distance);
}

TEST(NodesWithin, MeasuresAlongEdges) {
  const Surface surface = extract_surface(cube());
  EXPECT_EQ(nodes_within(surface, 1, 0), (std::vector<int>{1}));
  EXPECT_EQ(nodes_within(surface, 1, 0.999), (std::vector<int>{1}));
  EXPECT_EQ(nodes_within(surface, 1, 1.0), (std::vector<int>{0, 1, 3, 5}));
  // Corner 6, opposite to 1, is sqrt(3) away through the body, but three edges, or an edge and a diagonal,
  // along the surface.
  const std::vector<int> nearer = nodes_within(surface, 1, 2.0);
  EXPECT_FALSE(std::binary_search(nearer.begin(), nearer.end(), 6));
  EXPECT_EQ(nodes_within(surface, 1, 1 + std::sqrt(2.0)).size(), 8U);
  EXPECT_EQ(nodes_within(surface, 8, 100.0), (std::vector<int>{8})) << "a node off the surface is alone";
}

TEST(NodesWithin, DoesNotCrossAFissure) {
  // Two legs 0.1 apart, joined only at their far end. Nodes 0 and 3 face each other across the gap.
  //   0 -------- 1
  //   3 -------- 2     joined by the tetrahedron at 1 and 2
  const Model model = model_of({{0, 0.1, 0},
                                {1, 0.1, 0},
                                {1, 0, 0},
                                {0, 0, 0},
                                {1, 0.1, 1},
                                {1, 0, 1},
                                {0.9, 0.3, 0.5},
                                {0.9, -0.3, 0.5}},
                               {{0, 1, 6, 4}, {3, 7, 2, 5}, {1, 2, 5, 4}});
  const Surface surface = extract_surface(model);
  const std::vector<int> near = nodes_within(surface, 0, 0.5);
  EXPECT_EQ(near, (std::vector<int>{0}));
  const std::vector<int> far = nodes_within(surface, 0, 2.2);
  EXPECT_TRUE(std::binary_search(far.begin(), far.end(), 3));
}

TEST(NodesWithin, HoldsNodesAtExactlyTheRadius) {
  // A strip of edges of length 0.1: rounding makes the sum of ten edges a little less or more than 1.
  std::vector<Eigen::Vector3d> positions;
  for (int i = 0; i <= 10; ++i) {
    positions.emplace_back(0.1 * i, 0, 0);
    positions.emplace_back(0.1 * i, 1, 0);
    positions.emplace_back(0.1 * i, 0, 1);
  }
  std::vector<std::array<int, 4>> elements;
  for (int i = 0; i < 10; ++i) {
    const int a = 3 * i;
    elements.push_back({a, a + 3, a + 1, a + 2});
    elements.push_back({a + 3, a + 4, a + 1, a + 2});
    elements.push_back({a + 3, a + 4, a + 2, a + 5});
  }
  const Surface surface = extract_surface(model_of(positions, elements));
  const std::vector<int> within = nodes_within(surface, 0, 1.0);
  EXPECT_TRUE(std::binary_search(within.begin(), within.end(), 30));
}

TEST(OutwardNormals, PointAwayFromTheBody) {
  const Model model = cube();
  const std::vector<Eigen::Vector3d> normals = outward_normals(model, extract_surface(model));
  ASSERT_EQ(normals.size(), 9U);
  for (std::size_t node = 0; node < 8; ++node) {
    EXPECT_NEAR(normals[node].norm(), 1, 1e-14);
    EXPECT_GT(normals[node].dot(model.positions[node] - Eigen::Vector3d(0.5, 0.5, 0.5)), 0.5);
  }
  EXPECT_EQ(normals[8], Eigen::Vector3d::Zero());
  // Every side has the same area, and node 0 has two triangles of each of its three sides: its normal is the
  // diagonal.
  EXPECT_NEAR(normals[0].dot(Eigen::Vector3d(-1, -1, -1).normalized()), 1, 1e-14);
}

}  // namespace surface_test
}  // namespace palpate
