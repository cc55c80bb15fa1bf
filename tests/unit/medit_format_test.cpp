// Medit's files: those of Gmsh and Mmg, round trips and damage.
#include "offline/io/mesh_formats.hpp"

#include <gtest/gtest.h>

#include "offline/mesh/text_file.hpp"
#include "tests/support/mesh_files.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate {
namespace medit_format_test {

using namespace test;

MeshData read_bytes(const std::string& bytes) {
  FileCursor in("file.mesh", 1, bytes);
  return read_medit(in);
}

// In the manner of Gmsh 4.8.4: middles in Gmsh's order 01 12 02 03 23 13, and the dimension on a line of its
// own.
constexpr const char* kOfGmsh = R"( MeshVersionFormatted 2
 Dimension
 3
 Vertices
 10
 0 0 0 1
 2 0 0 2
 0 3 0 3
 0 0 4 4
 1 0 0 1
 1 1.5 0 2
 0 1.5 0 3
 0 0 2 4
 0 1.5 2 6
 1 0 2 5
 TrianglesP2
 1
 1 2 3 5 6 7 21
 TetrahedraP2
 1
 1 2 3 4 5 6 7 8 9 10 1
 End
)";

// In the manner of Mmg: comments, required entities and normals.
constexpr const char* kOfMmg = R"(MeshVersionFormatted 2
# by hand
Dimension 3
Vertices
4
0 0 0 0
1 0 0 0 # a comment
0 1 0 7
0 0 1 0
Tetrahedra
1
1 2 3 4 2
Triangles
2
1 3 2 10
1 2 4 11
RequiredVertices
2
1 2
Normals
1
0 0 -1.0
NormalAtVertices
1
1 1
End
)";

TEST(MeditFormat, BringsTheMiddlesOfGmshIntoOrder) {
  const MeshData mesh = read_bytes(kOfGmsh);
  ASSERT_EQ(mesh.cells.size(), 2U);
  EXPECT_EQ(mesh.cells[1].nodes, (std::array<int, 10>{0, 1, 2, 3, 4, 5, 6, 7, 9, 8}));
  // The reference of the triangle gives its middles too.
  EXPECT_EQ(mesh.node_sets.at("REF_21"), (std::vector<int>{0, 1, 2, 4, 5, 6}));
  EXPECT_EQ(mesh.element_sets.at("REF_21"), std::vector<int>{0});
}

TEST(MeditFormat, MakesSetsOfReferencesAndSkipsOtherSections) {
  const MeshData mesh = read_bytes(kOfMmg);
  ASSERT_EQ(mesh.cells.size(), 3U);
  EXPECT_EQ(mesh.cells[0].line, 12);
  EXPECT_EQ(mesh.element_sets,
            (std::map<std::string, std::vector<int>>{{"REF_10", {1}}, {"REF_11", {2}}, {"REF_2", {0}}}));
  EXPECT_EQ(mesh.node_sets, (std::map<std::string, std::vector<int>>{
                                {"REF_10", {0, 1, 2}}, {"REF_11", {0, 1, 3}}, {"REF_7", {2}}}));
}

TEST(MeditFormat, KeepsAMesh) {
  const TempDir dir;
  const MeshData mesh = mesh_with_everything();
  write_medit(mesh, {}, dir.path() / "a.mesh");
  expect_equal_meshes(read_mesh(dir.path() / "a.mesh"), mesh, false);
}

TEST(MeditFormat, KeepsTheNumberOfAReference) {
  const TempDir dir;
  write_medit(read_bytes(kOfMmg), {}, dir.path() / "a.mesh");
  std::string text;
  EXPECT_EQ(read_text_file(dir.path() / "a.mesh", text), "");
  EXPECT_NE(text.find("\n1 2 3 4 2\n"), std::string::npos) << text;
  EXPECT_NE(text.find("\n1 3 2 10\n"), std::string::npos) << text;
}

struct Damage {
  const char* from;
  const char* to;
  const char* message;
};

TEST(MeditFormat, RefusesDamageWithTheLineAndARemedy) {
  const Damage damages[] = {
      {"MeshVersionFormatted", "MFEM", "file.mesh:1: begins with 'MFEM', not with MeshVersionFormatted"},
      {"Dimension 3", "Dimension 2", "file.mesh:3: the mesh has dimension 2, not 3"},
      {"Vertices\n4", "Vertices\n5", "file.mesh:10: 'Tetrahedra' is no number"},
      {"Vertices\n4", "Vertices\n3", "file.mesh:9: '0' stands where a keyword should be"},
      {"Vertices\n4", "Vertices\n999999999", "file.mesh:5: the number of vertices is 999999999, more than"},
      {"1 2 3 4 2", "0 2 3 4 2",
       "file.mesh:12: a cell names vertex 0, but the vertices before it are 1 to 4"},
      {"1 2 3 4 2", "1 2 3 5 2", "file.mesh:12: a cell names vertex 5"},
      {"1 2 3 4 2", "1 2 3 4 x", "file.mesh:12: 'x' is no integer"},
      {"0 1 0 7", "0 inf 0 7", "file.mesh:8: 'inf' is no number"},
      {"Tetrahedra", "TetrahedraP3", "file.mesh:10: TetrahedraP3 are not supported"},
  };
  for (const Damage& damage : damages) {
    const std::string message = refusal(read_bytes, edited(kOfMmg, damage.from, damage.to));
    EXPECT_NE(message.find(damage.message), std::string::npos) << damage.to << ": " << message;
    EXPECT_NE(message.find(';'), std::string::npos) << message;
  }
}

TEST(MeditFormat, SurvivesDamageAtEveryByte) {
  for (const char* file : {kOfGmsh, kOfMmg}) EXPECT_GT(expect_clear_refusals(read_bytes, file), 100);
}

}  // namespace medit_format_test
}  // namespace palpate
