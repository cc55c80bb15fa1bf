// Cells split into tetrahedra fill the same space and fit together, whatever the node numbers are.
#include "offline/io/mesh_split.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>
#include <random>

#include "tests/support/mesh_files.hpp"

namespace palpate {
namespace mesh_split_test {

using test::cell_of;

// Three cubes in a row: a hexahedron, two wedges, and six pyramids around a centre. Node i has the number
// order[i].
MeshData row_of_cubes(const std::vector<int>& order) {
  std::vector<Eigen::Vector3d> places;
  for (int x = 0; x < 4; ++x) {
    for (int y = 0; y < 2; ++y) {
      for (int z = 0; z < 2; ++z) places.emplace_back(x, y, z);
    }
  }
  places.emplace_back(2.5, 0.5, 0.5);
  MeshData mesh;
  mesh.positions.resize(17);
  for (std::size_t i = 0; i < 17; ++i) mesh.positions[static_cast<std::size_t>(order[i])] = places[i];
  mesh.node_labels.resize(17);
  std::iota(mesh.node_labels.begin(), mesh.node_labels.end(), 1);
  const auto corner = [](int x, int y, int z) { return 4 * x + 2 * y + z; };
  const auto cube = [&](int x) {  // in the order of a hexahedron
    return std::vector<int>{corner(x, 0, 0), corner(x + 1, 0, 0), corner(x + 1, 1, 0), corner(x, 1, 0),
                            corner(x, 0, 1), corner(x + 1, 0, 1), corner(x + 1, 1, 1), corner(x, 1, 1)};
  };
  const auto add = [&](CellKind kind, std::vector<int> nodes) {
    for (int& node : nodes) node = order[static_cast<std::size_t>(node)];
    mesh.cells.push_back(cell_of(kind, static_cast<int>(mesh.cells.size()) + 1, nodes));
  };
  add(CellKind::hexahedron, cube(0));
  const std::vector<int> b = cube(1);
  add(CellKind::wedge, {b[0], b[1], b[2], b[4], b[5], b[6]});
  add(CellKind::wedge, {b[0], b[2], b[3], b[4], b[6], b[7]});
  const std::vector<int> c = cube(2);
  constexpr std::size_t kInward[6][4] = {{0, 1, 2, 3}, {4, 7, 6, 5}, {0, 4, 5, 1},
                                         {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}};
  for (const auto& face : kInward)
    add(CellKind::pyramid, {c[face[0]], c[face[1]], c[face[2]], c[face[3]], 16});
  return mesh;
}

TEST(MeshSplit, FillsTheBodyWithTetrahedraThatFitTogether) {
  std::mt19937 random(5);
  std::vector<int> order(17);
  std::iota(order.begin(), order.end(), 0);
  for (int round = 0; round < 300; ++round) {
    MeshData mesh = row_of_cubes(order);
    EXPECT_EQ(split_into_tetrahedra(mesh), 9U);
    double volume = 0;
    std::map<std::array<int, 3>, int> count;  // tetrahedra at each face
    for (const MeshCell& cell : mesh.cells) {
      ASSERT_EQ(cell.num_nodes, 4);
      const auto place = [&](std::size_t i) {
        return mesh.positions[static_cast<std::size_t>(cell.nodes[i])];
      };
      const double part = (place(1) - place(0)).cross(place(2) - place(0)).dot(place(3) - place(0)) / 6;
      EXPECT_GT(part, 0.01);
      volume += part;
      for (std::size_t left_out = 0; left_out < 4; ++left_out) {
        std::array<int, 3> face = {};
        for (std::size_t i = 0, k = 0; i < 4; ++i) {
          if (i != left_out) face[k++] = cell.nodes[i];
        }
        std::sort(face.begin(), face.end());
        ++count[face];
      }
    }
    EXPECT_NEAR(volume, 3, 1e-12);
    double area = 0;  // of faces with one tetrahedron
    for (const auto& [face, number] : count) {
      EXPECT_LE(number, 2);
      const auto& corners = face;  // clang 14 captures no structured binding
      const auto place = [&](std::size_t i) { return mesh.positions[static_cast<std::size_t>(corners[i])]; };
      if (number == 1) area += 0.5 * (place(1) - place(0)).cross(place(2) - place(0)).norm();
    }
    EXPECT_NEAR(area, 14, 1e-12);
    std::shuffle(order.begin(), order.end(), random);
  }
}

TEST(MeshSplit, CarriesSetsValuesAndLabels) {
  std::vector<int> order(17);
  std::iota(order.begin(), order.end(), 0);
  MeshData mesh = row_of_cubes(order);
  mesh.cells.insert(mesh.cells.begin() + 1, cell_of(CellKind::triangle, 50, {0, 1, 2}));
  mesh.element_sets = {{"HEXAHEDRON", {0}}, {"TRIANGLE", {1}}, {"WEDGES", {2, 3}}};
  mesh.cell_arrays = {{"E", 2, {}}};
  for (int i = 0; i < 20; ++i) mesh.cell_arrays[0].values.push_back(i);
  split_into_tetrahedra(mesh);
  EXPECT_EQ(mesh.element_sets.at("HEXAHEDRON"), (std::vector<int>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(mesh.element_sets.at("TRIANGLE"), std::vector<int>{6});
  EXPECT_EQ(mesh.element_sets.at("WEDGES"), (std::vector<int>{7, 8, 9, 10, 11, 12}));
  ASSERT_EQ(mesh.cell_arrays[0].values.size(), 2 * mesh.cells.size());
  EXPECT_EQ(mesh.cell_arrays[0].values[2 * 9 + 1], 5);   // the first wedge
  EXPECT_EQ(mesh.cell_arrays[0].values[2 * 10 + 1], 7);  // the second
  EXPECT_EQ(mesh.cells[6].label, 50);
  EXPECT_EQ(mesh.cells[0].label, 1);
  EXPECT_EQ(mesh.cells[1].label, 51);
}

TEST(MeshSplit, LeavesOutPartsOfACollapsedCell) {
  MeshData mesh = row_of_cubes({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16});
  // A wedge, written as a hexahedron with two equal pairs of nodes.
  const auto& n = mesh.cells[0].nodes;
  mesh.cells = {cell_of(CellKind::hexahedron, 1, {n[0], n[1], n[2], n[2], n[4], n[5], n[6], n[6]})};
  EXPECT_EQ(split_into_tetrahedra(mesh), 1U);
  EXPECT_EQ(mesh.cells.size(), 3U);
}

}  // namespace mesh_split_test
}  // namespace palpate
