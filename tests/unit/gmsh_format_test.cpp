// Gmsh's files: those of Gmsh itself, round trips and damage.
#include "offline/io/mesh_formats.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/gmsh_files.hpp"
#include "tests/support/mesh_files.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate {
namespace gmsh_format_test {

using namespace test;

MeshData read_bytes(const std::string& bytes) {
  FileCursor in("file.msh", 1, bytes);
  return read_gmsh(in);
}

std::string refusal_of(const std::string& bytes) {
  return refusal(read_bytes, bytes);
}

std::vector<std::string> files_of_gmsh() {
  return {kGmsh1, kGmsh22, kGmsh41, bytes_of(kBinaryGmsh22), bytes_of(kBinaryGmsh41)};
}

TEST(GmshFormat, ReadsTheFilesOfGmsh) {
  constexpr std::size_t kEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  for (const std::string& file : files_of_gmsh()) {
    SCOPED_TRACE(file.substr(0, 40));
    const MeshData mesh = read_bytes(file);
    ASSERT_EQ(mesh.positions.size(), 10U);
    ASSERT_EQ(mesh.cells.size(), 2U);
    EXPECT_EQ(mesh.cells[0].kind, CellKind::triangle);
    EXPECT_EQ(mesh.cells[0].num_nodes, 3);
    const MeshCell& cell = mesh.cells[1];
    ASSERT_EQ(cell.num_nodes, 10);
    const auto place = [&](std::size_t i) { return mesh.positions[static_cast<std::size_t>(cell.nodes[i])]; };
    const double volume = (place(1) - place(0)).cross(place(2) - place(0)).dot(place(3) - place(0)) / 6;
    EXPECT_NEAR(volume, 4, 1e-12);
    for (std::size_t i = 0; i < 6; ++i)
      EXPECT_LT((place(4 + i) - 0.5 * (place(kEdges[i][0]) + place(kEdges[i][1]))).norm(), 1e-9)
          << "edge " << i;
    const bool has_names = file != kGmsh1;
    const auto all = mesh.element_sets.find(has_names ? "ALL" : "VOLUME_2");
    const auto tissue = mesh.element_sets.find(has_names ? "Soft tissue" : "VOLUME_1");
    const auto fixed = mesh.node_sets.find(has_names ? "FIXED" : "SURFACE_3");
    ASSERT_TRUE(all != mesh.element_sets.end() && tissue != mesh.element_sets.end());
    EXPECT_EQ(all->second, std::vector<int>{1});
    EXPECT_EQ(tissue->second, std::vector<int>{1});
    // The middles of the face belong to its node set.
    ASSERT_TRUE(fixed != mesh.node_sets.end());
    ASSERT_EQ(fixed->second.size(), 6U);
    for (const int node : fixed->second) EXPECT_EQ(mesh.positions[static_cast<std::size_t>(node)].z(), 0);
    ASSERT_TRUE(mesh.node_sets.contains("POINT_9"));
    EXPECT_EQ(mesh.node_sets.at("POINT_9"), std::vector<int>{3});
    EXPECT_EQ(mesh.positions[3], Eigen::Vector3d(0, 0, 4));
  }
}

TEST(GmshFormat, KeepsAMeshThroughEachVersion) {
  const TempDir dir;
  MeshData mesh = mesh_with_everything();
  mesh.cells.push_back(cell_of(CellKind::triangle, 101, {9, 10, 11}));  // out of the order of kinds
  mesh.cells.push_back(cell_of(CellKind::point, 102, {9}));
  mesh.cell_arrays[0].values.insert(mesh.cell_arrays[0].values.end(), {-1.0, 1e300});
  for (const char* name : {"a.msh1", "a.msh2", "a.msh4", "a.msh"}) {
    for (const bool is_binary : {false, true}) {
      SCOPED_TRACE(name);
      write_gmsh(mesh, {is_binary}, dir.path() / name);
      const MeshData found = read_mesh(dir.path() / name);
      expect_equal_meshes(found, mesh, true);
      expect_equal_arrays(found.point_arrays, mesh.point_arrays);
      expect_equal_arrays(found.cell_arrays, mesh.cell_arrays);
      EXPECT_TRUE(found.notes.empty());
    }
  }
}

TEST(GmshFormat, NumbersAnewWhereLabelsAreNotUnique) {
  const TempDir dir;
  MeshData mesh = mesh_with_everything();
  mesh.node_labels[3] = mesh.node_labels[4];
  mesh.cells[0].label = 0;
  write_gmsh(mesh, {}, dir.path() / "a.msh");
  const MeshData found = read_mesh(dir.path() / "a.msh");
  expect_equal_meshes(found, mesh, false);
  EXPECT_EQ(found.node_labels[0], 1);
  EXPECT_EQ(found.cells[9].label, 10);
}

TEST(GmshFormat, RefusesToWriteANameWithAQuotationMark) {
  const TempDir dir;
  MeshData mesh = mesh_with_everything();
  mesh.node_sets["a\"b"] = {1};
  EXPECT_THROW(write_gmsh(mesh, {}, dir.path() / "a.msh"), std::runtime_error);
}

// A file with the most significant byte first, built by hand.
TEST(GmshFormat, ReadsTheOtherByteOrder) {
  std::string bytes = "$MeshFormat\n2.2 1 8\n";
  const auto add = [&](const auto& number) {
    std::string part(reinterpret_cast<const char*>(&number), sizeof number);
    std::reverse(part.begin(), part.end());
    bytes += part;
  };
  add(std::int32_t{1});
  bytes += "\n$EndMeshFormat\n$Nodes\n4\n";
  for (int i = 0; i < 4; ++i) {
    add(std::int32_t{i + 1});
    for (int axis = 0; axis < 3; ++axis) add(i == axis + 1 ? 2.5 : 0.0);
  }
  bytes += "\n$EndNodes\n$Elements\n1\n";
  for (const int number : {4, 1, 2, 77, 0, 1, 1, 2, 3, 4}) add(std::int32_t{number});
  bytes += "\n$EndElements\n";
  const MeshData mesh = read_bytes(bytes);
  ASSERT_EQ(mesh.cells.size(), 1U);
  EXPECT_EQ(mesh.cells[0].label, 77);
  EXPECT_EQ(mesh.cells[0].line, 0);
  EXPECT_EQ(mesh.positions[3], Eigen::Vector3d(0, 0, 2.5));
}

TEST(GmshFormat, ReadsParametricNodesAndSkipsUnknownSections) {
  const std::string parametric =
      edited(kGmsh41, "1 1 0 1\n5\n0.9999999999973436 0 0", "1 1 1 1\n5\n0.9999999999973436 0 0 0.5");
  const std::string skipped =
      edited(parametric, "$Entities", "$Periodic\n$Nodes 12 x\n$EndPeriodic\n$Entities");
  EXPECT_EQ(read_bytes(skipped).positions, read_bytes(kGmsh41).positions);
}

// A search for "$EndX" alone would pass the mesh, and the rest of the file for each such section.
TEST(GmshFormat, AnUnknownSectionEndsAtTheFirstOfBothSpellings) {
  const std::string skipped = std::string("$X\n$EndXY\n$ENDX\n") + kGmsh22 + "$X\n$EndX\n";
  EXPECT_EQ(read_bytes(skipped).positions, read_bytes(kGmsh22).positions);
  EXPECT_EQ(refusal_of("$X\n$EndXY\n"), "file.msh:1: $X has no $EndX; export the file again");
}

TEST(GmshFormat, ReadsTheLastTimeStepAndSaysWhatIsMissing) {
  const auto data = [](int step, const std::string& rows, int count) {
    return "$NodeData\n1\n\"p\"\n1\n0.5\n3\n" + std::to_string(step) + "\n1\n" + std::to_string(count) +
           "\n" + rows + "$EndNodeData\n";
  };
  const MeshData mesh = read_bytes(kGmsh22 + data(0, "1 5\n2 6\n", 2) + data(1, "2 7.5\n10 8\n", 2));
  ASSERT_EQ(mesh.point_arrays.size(), 1U);
  EXPECT_EQ(mesh.point_arrays[0].values, (std::vector<double>{0, 7.5, 0, 0, 0, 0, 0, 0, 0, 8}));
  ASSERT_EQ(mesh.notes.size(), 2U);
  EXPECT_EQ(mesh.notes[1], "'p' has no values for 8 nodes; they get 0");
}

TEST(GmshFormat, KeepsQuadraticHexahedraByTheirCornersAndSaysSo) {
  std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n20\n";
  for (int i = 1; i <= 20; ++i) text += std::to_string(i) + " 0 0 " + std::to_string(i) + "\n";
  text += "$EndNodes\n$Elements\n1\n1 17 2 0 1";
  for (int i = 1; i <= 20; ++i) text += " " + std::to_string(i);
  const MeshData mesh = read_bytes(text + "\n$EndElements\n");
  ASSERT_EQ(mesh.cells.size(), 1U);
  EXPECT_EQ(mesh.cells[0].num_nodes, 8);
  EXPECT_EQ(mesh.cells[0].nodes[7], 7);
  ASSERT_EQ(mesh.notes.size(), 1U);
  EXPECT_EQ(mesh.notes[0], "1 quadratic hexahedra of 20 nodes are kept by their corners");
}

struct Damage {
  const char* from;
  const char* to;
  const char* message;  // a part of it, with the line
};

TEST(GmshFormat, RefusesDamageWithTheLineAndARemedy) {
  const Damage damages[] = {
      {"2.2 0 8", "4.0 0 8", "file.msh:2: Gmsh's format 4.0 is not read; save the file as 4.1"},
      {"2.2 0 8", "2.2 7 8", "file.msh:2: the file type is 7"},
      {"$Nodes\n10", "$Nodes\n9", "file.msh:21: '10' stands where $EndNodes should be"},
      {"$Nodes\n10", "$Nodes\n11", "file.msh:22: '$EndNodes' is no integer"},
      {"$Nodes\n10", "$Nodes\n2000000000", "file.msh:11: the number of nodes is 2000000000, more than"},
      {"$Nodes\n10", "$Nodes\n-1", "file.msh:11: the number of nodes is negative"},
      {"2 2 0 0", "2 nan 0 0", "file.msh:13: 'nan' is no number"},
      {"2 2 0 0", "2 2,5 0 0", "file.msh:13: '2,5' is no number"},
      {"2 2 0 0", "1 2 0 0", "file.msh:10: node 1 stands twice"},
      {"1 1 2 3 5 6 7", "1 0 2 3 5 6 7", "node 0 is not among the nodes"},
      {"1 1 2 3 5 6 7", "1 1 2 99 5 6 7", "file.msh:26: node 99 is not among the nodes"},
      {"2 9 2 3", "2 29 2 3", "file.msh:26: cubic tetrahedra of 20 nodes (Gmsh's type 29) are not supported"},
      {"2 9 2 3", "2 1234 2 3", "file.msh:26: Gmsh's element type 1234 is not supported"},
      {"$EndElements", "", "file.msh:30: the file ends where $EndElements should be"},
      {"$MeshFormat", "MeshFormat", "file.msh:1: 'MeshFormat' stands where a section such as $Nodes"},
  };
  for (const Damage& damage : damages) {
    const std::string message = refusal_of(edited(kGmsh22, damage.from, damage.to));
    EXPECT_NE(message.find(damage.message), std::string::npos) << damage.to << ": " << message;
    EXPECT_NE(message.find(';'), std::string::npos) << message;
  }
  const Damage of_blocks[] = {
      {"12 10 1 10", "12 11 1 10", "the blocks hold 10 nodes, but their section states 11"},
      {"3 3 1 3", "3 2 1 3", "the blocks hold 3 elements, but their section states 2"},
      {"3 1 11 1", "3 1 11 900000", "is 900000, more than the rest of the file holds"},
      {"1 0 0 0 0 \n", "1 0 0 0 101 \n", "file.msh:12: an entity is in 101 physical groups; use at most 100"},
  };
  for (const Damage& damage : of_blocks) {
    const std::string message = refusal_of(edited(kGmsh41, damage.from, damage.to));
    EXPECT_NE(message.find(damage.message), std::string::npos) << damage.to << ": " << message;
  }
}

TEST(GmshFormat, SurvivesDamageAtEveryByte) {
  for (const std::string& file : files_of_gmsh()) EXPECT_GT(expect_clear_refusals(read_bytes, file), 300);
}

}  // namespace gmsh_format_test
}  // namespace palpate
