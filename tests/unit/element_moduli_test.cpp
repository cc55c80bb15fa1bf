// Arrays of moduli become a few materials, and arrays of labels become sets.
#include "offline/io/element_moduli.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "offline/mesh/input_error.hpp"

namespace palpate {
namespace element_moduli_test {

// Tetrahedra that share nothing, with a triangle before them that has no modulus.
MeshData mesh_of(int num_tetrahedra) {
  MeshData mesh;
  mesh.file = "organ.vtu";
  mesh.positions.resize(static_cast<size_t>(4 * num_tetrahedra));
  MeshCell triangle;
  triangle.kind = CellKind::triangle;
  triangle.num_nodes = 3;
  mesh.cells.push_back(triangle);
  for (int i = 0; i < num_tetrahedra; ++i) {
    MeshCell cell;
    cell.num_nodes = 4;
    for (int a = 0; a < 4; ++a) cell.nodes[static_cast<size_t>(a)] = 4 * i + a;
    mesh.cells.push_back(cell);
  }
  number_from_one(mesh);
  return mesh;
}

void add_cells(MeshData& mesh, const std::string& name, std::vector<double> values) {
  values.insert(values.begin(), -1);  // of the triangle
  mesh.cell_arrays.push_back({name, 1, std::move(values)});
}

std::string refusal(const MeshData& mesh) {
  try {
    find_element_moduli(mesh, 1, 0.49);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ElementModuli, StayExactWhereTheyAreFew) {
  MeshData mesh = mesh_of(4);
  EXPECT_TRUE(find_element_moduli(mesh, 1, 0.49).empty());
  add_cells(mesh, "e", {10, 1, 10, 1});
  add_cells(mesh, "Nu", {0.3, 0.3, 0.45, 0.3});
  const ElementModuli moduli = find_element_moduli(mesh, 7, 0.49);
  ASSERT_EQ(moduli.groups.size(), 3U);
  EXPECT_EQ(moduli.group_of_element, (std::vector<int>{1, 0, 2, 0}));
  EXPECT_EQ(moduli.groups[0].young, 1);
  EXPECT_EQ(moduli.groups[0].nu, 0.3);
  EXPECT_EQ(moduli.groups[2].young, 10);
  EXPECT_EQ(moduli.groups[2].nu, 0.45);
  EXPECT_EQ(moduli.largest_change, 0);
  EXPECT_EQ(moduli.largest_nu_change, 0);
}

TEST(ElementModuli, OfPointsAreTheMeanOfTheCorners) {
  MeshData mesh = mesh_of(2);
  mesh.point_arrays.push_back({"E", 1, {1, 2, 3, 6, 5, 5, 5, 5}});
  const ElementModuli moduli = find_element_moduli(mesh, 7, 0.4);
  ASSERT_EQ(moduli.groups.size(), 2U);
  EXPECT_EQ(moduli.groups[0].young, 3);
  EXPECT_EQ(moduli.groups[1].young, 5);
  EXPECT_EQ(moduli.groups[1].nu, 0.4);
  EXPECT_TRUE(moduli.has_young);
  EXPECT_FALSE(moduli.has_nu);
}

// A field of 4000 values over a factor of 4, and over a factor of 1e6: in both cases few materials, and each
// element's modulus within the change that is said.
TEST(ElementModuli, AreCollectedInGeometricSteps) {
  constexpr int kElements = 4000;
  for (const double range : {4.0, 1e6}) {
    MeshData mesh = mesh_of(kElements);
    std::vector<double> young;
    for (int i = 0; i < kElements; ++i) young.push_back(std::pow(range, i / (kElements - 1.0)));
    add_cells(mesh, "E", young);
    const ElementModuli moduli = find_element_moduli(mesh, 1, 0.49);
    EXPECT_LE(moduli.groups.size(), static_cast<size_t>(kMostModuli));
    double change = 0;
    for (size_t i = 0; i < young.size(); ++i) {
      const double grouped = moduli.groups[static_cast<size_t>(moduli.group_of_element[i])].young;
      change = std::max(change, std::abs(grouped / young[i] - 1));
    }
    EXPECT_NEAR(change, moduli.largest_change, 1e-9);
    EXPECT_EQ(moduli.largest_nu_change, 0);
    EXPECT_LT(change, range == 4.0 ? 0.026 : 0.3);
  }
}

// Steps of 1/2 - nu: near 1/2 the bulk modulus goes as its inverse.
TEST(ElementModuli, KeepTheBulkModulusNearTheLimit) {
  constexpr int kElements = 100;
  MeshData mesh = mesh_of(kElements);
  std::vector<double> nu;
  for (int i = 0; i < kElements; ++i) nu.push_back(0.48 + 0.015 * i / (kElements - 1));
  add_cells(mesh, "nu", nu);
  const ElementModuli moduli = find_element_moduli(mesh, 3, 0.49);
  EXPECT_LE(moduli.groups.size(), static_cast<size_t>(kMostModuli));
  EXPECT_FALSE(moduli.has_young);
  for (size_t i = 0; i < nu.size(); ++i) {
    const ElementModuli::Group& group = moduli.groups[static_cast<size_t>(moduli.group_of_element[i])];
    EXPECT_EQ(group.young, 3);
    EXPECT_NEAR((0.5 - group.nu) / (0.5 - nu[i]), 1, 0.055);
  }
}

TEST(ElementModuli, RefuseWhatNoTissueHas) {
  MeshData mesh = mesh_of(2);
  add_cells(mesh, "E", {1, 0});
  EXPECT_EQ(refusal(mesh),
            "organ.vtu: array E: element 3 has 0; Young's modulus must be above 0; correct it, or rename an "
            "array that means something else");
  mesh = mesh_of(2);
  add_cells(mesh, "nu", {0.5, 0.3});
  EXPECT_EQ(
      refusal(mesh),
      "organ.vtu: array nu: element 2 has 0.5; Poisson's ratio must lie in 0 .. 0.4999; correct it, with "
      "0.49 for soft tissue");
  mesh.cell_arrays[0].values[1] = std::nan("");
  EXPECT_NE(refusal(mesh), "accepted");
}

TEST(ElementModuli, LabelsBecomeSets) {
  MeshData mesh = mesh_of(3);
  add_cells(mesh, "region", {2, 7, 2});
  add_cells(mesh, "id", {1, 1, 1});       // one value says nothing
  add_cells(mesh, "depth", {0.5, 1, 2});  // no labels
  add_cells(mesh, "E", {1, 2, 3});        // moduli
  labels_to_sets(mesh);
  ASSERT_EQ(mesh.element_sets.size(), 2U);
  EXPECT_EQ(mesh.element_sets.at("REGION_2"), (std::vector<int>{1, 3}));
  EXPECT_EQ(mesh.element_sets.at("REGION_7"), std::vector<int>{2});
  mesh = mesh_of(40);
  std::vector<double> numbers(40);
  for (size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<double>(i);
  add_cells(mesh, "number", numbers);  // a number for each cell
  labels_to_sets(mesh);
  EXPECT_TRUE(mesh.element_sets.empty());
}

}  // namespace element_moduli_test
}  // namespace palpate
