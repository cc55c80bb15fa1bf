// Bad mesh files: each is refused in one line with its place and a remedy, or is read right.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tests/support/mesh_files.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/sound_meshes.hpp"
#include "tests/support/vtu_files.hpp"

namespace palpate::test {
namespace cli_bad_files_test {

int line_of(const std::string& text, std::string_view word) {
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(text.find(word));
  return 1 + static_cast<int>(std::count(text.begin(), end, '\n'));
}

std::string with_line_ends(const std::string& text, const std::string& end) {
  std::string changed;
  for (const char letter : text) letter == '\n' ? changed += end : changed += letter;
  return changed;
}

class BadFiles : public ::testing::Test {
 protected:
  BadFiles() { dir_.write("organ.ele", kElements); }

  // The line that refuses the file. Expects that it begins with the name of the file and has a remedy.
  std::string refusal(const std::string& name, const std::string& bytes) const {
    const std::string line = dir_.without_folder(refusal_of({"check", dir_.write(name, bytes).string()}));
    EXPECT_TRUE(line.starts_with("organ.")) << line;
    EXPECT_NE(line.find("; "), std::string::npos) << line;
    EXPECT_LT(line.size(), 300U);
    return line;
  }

  void expect_refusal(const std::string& name, const std::string& bytes, const std::string& message) const {
    EXPECT_EQ(refusal(name, bytes), message);
  }

  void expect_is_read(const std::string& name, const std::string& bytes) const {
    const std::string file = dir_.write(name, bytes).string();
    const ProgramRun run = run_program(
        is_surface(name) ? std::vector<std::string>{"convert", file, (dir_.path() / "out.ply").string()}
                         : std::vector<std::string>{"check", file});
    EXPECT_EQ(run.exit_code, 0) << name << ": " << run.error;
    EXPECT_NE(run.out.find(is_surface(name) ? ": 4 nodes, 2 triangles" : ": 5 nodes, 2 elements"),
              std::string::npos)
        << name << ": " << run.out;
  }

  TempDir dir_;
};

TEST_F(BadFiles, EveryFormatIsReadWithForeignLineEndsAndLetters) {
  for (const SoundFile& file : sound_files()) {
    expect_is_read(file.name, file.text);
    expect_is_read(file.name, with_line_ends(file.text, "\r\n"));
    expect_is_read(file.name, "\xef\xbb\xbf" + file.text);
    expect_is_read(file.name, file.text.substr(0, file.text.size() - 1));  // without the last line end
    const std::size_t second_line = file.text.find('\n') + 1;
    if (*file.comment != 0 && file.text[0] != '$' && file.text[0] != '*')
      expect_is_read(file.name,
                     file.text.substr(0, second_line) + file.comment + file.text.substr(second_line));
    if (*file.comment == '$' || *file.comment == '*') expect_is_read(file.name, file.text + file.comment);
  }
  expect_is_read("organ.vtu", edited(kVtu, "<?xml version=\"1.0\"?>",
                                     "<!DOCTYPE a [<!ENTITY b \"0 0 0\"><!ENTITY c \"&b;&b;\">]>"));
  expect_is_read("organ.stl", edited(kStl, "solid liver", "solid bl\xe4ttchen"));
  expect_is_read("organ.vtk", edited(kVtk, "title", "bl\xe4ttchen"));
  expect_is_read("organ.vtk",
                 kVtk + "POINT_DATA 5\nSCALARS bl\xe4ttchen float\nLOOKUP_TABLE default\n1 2 3 4 5\n");
  expect_is_read("organ.vtu", edited(kVtu, "<Points>",
                                     "<PointData><DataArray type=\"Int32\" Name=\"bl\xe4ttchen\">1 2 3 4 5"
                                     "</DataArray></PointData><Points>"));
}

TEST_F(BadFiles, CoordinatesThatAreNoNumbersAreNamedByTheirLine) {
  for (const SoundFile& file : sound_files()) {
    const std::string place =
        std::string(file.name) + ":" + std::to_string(line_of(file.text, "0.625")) + ": ";
    for (const char* word : {"nan", "inf", "-Infinity", "1e999", "0,625", "0x1p3", "1.5.2", "\xe4"}) {
      const std::string line = refusal(file.name, edited(file.text, "0.625", word));
      EXPECT_TRUE(line.starts_with(place)) << word << ": " << line;
    }
    const std::string with_comma = refusal(file.name, edited(file.text, "0.625", "0,625"));
    if (std::string(file.name) != "organ.inp") {
      EXPECT_EQ(with_comma, place +
                                "'0,625' is no number, where a coordinate should be; write decimals with a "
                                "point, and blanks between numbers");
    }
  }
}

TEST_F(BadFiles, CutFilesAreRefused) {
  for (const SoundFile& file : sound_files()) {
    const bool may_end_anywhere =
        std::string(file.name) == "organ.obj" || std::string(file.name) == "organ.inp";
    for (std::size_t tenth = 1; tenth < 10 && !may_end_anywhere; ++tenth)
      refusal(file.name, file.text.substr(0, file.text.size() * tenth / 10));
  }
}

TEST_F(BadFiles, OtherThingsThanMeshesAreRefused) {
  for (const SoundFile& file : sound_files()) {
    expect_refusal(file.name, "", std::string(file.name) + ": is empty; copy or export it again");
    for (const SoundFile& other : sound_files()) {
      const bool is_same = std::string(other.name).substr(0, 9) == std::string(file.name).substr(0, 9);
      if (!is_same) refusal(file.name, other.text);
    }
    refusal(file.name, std::string(10'000'000, '1'));  // a line of 10 MB
    refusal(file.name, std::string("\x7f"
                                   "ELF\2\1\1\0\0\0",
                                   10) +
                           std::string(5000, '\0'));
    refusal(file.name, "\xff\xfe" + with_line_ends(file.text, std::string("\n\0", 2)));
    const std::filesystem::path folder = dir_.path() / file.name;
    std::filesystem::remove(folder);
    std::filesystem::create_directory(folder);
    EXPECT_EQ(dir_.without_folder(refusal_of({"check", folder.string()})),
              std::string(file.name) + ": is a folder; name a file");
    std::filesystem::remove(folder);
    EXPECT_EQ(dir_.without_folder(refusal_of({"new", folder.string()})),
              std::string(file.name) + ": cannot be read (No such file or directory); check its name");
    if (std::string(file.name) == "organ.node") dir_.write("organ.ele", kElements);
  }
  EXPECT_NE(
      refusal_of({"check", dir_.write("organ.doc", "text").string()}).find("has no ending of a mesh format"),
      std::string::npos);
}

struct Damage {  // of one word
  const char* name;
  const std::string& text;
  const char* from;
  const char* to;
  const char* message;
};

const Damage kDamages[] = {
    {"organ.msh", kGmsh2, "$Nodes\n5", "$Nodes\n4",
     "organ.msh:10: '5' stands where $EndNodes should be; the count of the section is wrong, so export the "
     "file again"},
    {"organ.msh", kGmsh2, "$Nodes\n5", "$Nodes\n6",
     "organ.msh:11: '$EndNodes' is no integer, where the number of a node should be; correct it"},
    {"organ.msh", kGmsh2, "$Nodes\n5", "$Nodes\n-5",
     "organ.msh:5: the number of nodes is negative; export the file again"},
    {"organ.msh", kGmsh2, "$Nodes\n5", "$Nodes\n2147483648",
     "organ.msh:5: 2147483648 is beyond 2147483647, where the number of nodes should be; renumber the "
     "mesh, or export it again"},
    {"organ.msh", kGmsh2, "$Nodes\n5", "$Nodes\n9223372036854775808",
     "organ.msh:5: 9223372036854775808 is beyond 2147483647, where the number of nodes should be; renumber "
     "the mesh, or export it again"},
    {"organ.msh", kGmsh2, "1 1 2 3 4", "1 0 1 2 3",
     "organ.msh:14: node 0 is not among the nodes; export the file again, with all nodes"},
    {"organ.msh", kGmsh2, "2 4 2 0", "1 4 2 0",
     "organ.msh:12: element 1 stands twice in the elements; renumber the elements"},
    {"organ.msh", kGmsh2, "5 0.625", "4 0.625",
     "organ.msh:4: node 4 stands twice in the nodes; renumber the nodes"},
    {"organ.msh", kGmsh2, "2 4 2 0", "2 44 2 0",
     "organ.msh:15: Gmsh's element type 44 is not supported; export the mesh with elements of order 1 or "
     "2"},
    {"organ.msh", kGmsh4, "1 5 1 5", "1 2147483647 1 5",
     "organ.msh:5: the number of nodes is 2147483647, more than the rest of the file holds; export it "
     "again"},
    {"organ.msh", kGmsh4, "3 1 0 5", "3 1 0 4",
     "organ.msh:15: the blocks hold 4 nodes, but their section states 5; export the file again"},
    {"organ.msh", kGmsh4, "1 2 1 2", "-1 2 1 2",
     "organ.msh:19: the number of blocks of elements is negative; export the file again"},
    {"organ.msh", kGmsh4, "4.1", "3.0",
     "organ.msh:2: Gmsh's format 3.0 is not read; save the file as 4.1: gmsh FILE -save -format msh41 -o "
     "NEW.msh"},
    {"organ.mesh", kMedit, "Vertices\n5", "Vertices\n4",
     "organ.mesh:9: '0.625' stands where a keyword should be; the count of the section before is wrong, so "
     "export the file again"},
    {"organ.mesh", kMedit, "Vertices\n5", "Vertices\n2147483648",
     "organ.mesh:4: 2147483648 is beyond 2147483647, where the number of vertices should be; renumber the "
     "mesh, or export it again"},
    {"organ.mesh", kMedit, "1 2 3 4 0", "0 1 2 3 0",
     "organ.mesh:12: a cell names vertex 0, but the vertices before it are 1 to 5; correct it, or export "
     "the file again"},
    {"organ.mesh", kMedit, "2 3 4 5 0", "2 3 4 6 0",
     "organ.mesh:13: a cell names vertex 6, but the vertices before it are 1 to 5; correct it, or export "
     "the file again"},
    {"organ.mesh", kMedit, "Dimension 3", "Dimension 2",
     "organ.mesh:2: the mesh has dimension 2, not 3; export a mesh in space"},
    {"organ.vtk", kVtk, "POINTS 5", "POINTS 4",
     "organ.vtk:10: '0.625' is no keyword of a VTK file; correct the count of the section before, or "
     "export it again"},
    {"organ.vtk", kVtk, "POINTS 5", "POINTS 2147483648",
     "organ.vtk:5: 2147483648 is beyond 2147483647, where the number of points should be; renumber the "
     "mesh, or export it again"},
    {"organ.vtk", kVtk, "CELLS 2 10", "CELLS 2 9",
     "organ.vtk:13: cell 1 with 4 nodes passes the end of its section; export the file again"},
    {"organ.vtk", kVtk, "CELLS 2 10", "CELLS 2 -1",
     "organ.vtk:11: the size of the cells is negative; export the file again"},
    {"organ.vtk", kVtk, "4 1 2 3 4", "4 1 2 3 5",
     "organ.vtk:13: cell 1 names point 5, where points are 0 to 4; export the file again"},
    {"organ.vtk", kVtk, "4 1 2 3 4", "4 1 2 3 -1",
     "organ.vtk:13: cell 1 names point -1, where points are 0 to 4; export the file again"},
    {"organ.vtk", kVtk, "CELL_TYPES 2", "CELL_TYPES 3",
     "organ.vtk:14: there are 3 cell types for 2 cells; export the file again"},
    {"organ.vtk", kVtk, "Version 4.2", "Version 9.9",
     "organ.vtk:1: version '9.9' of VTK's format is not known; write version 5.1 or older"},
    {"organ.vtk", kVtk, "UNSTRUCTURED_GRID", "STRUCTURED_POINTS",
     "organ.vtk:4: data of kind STRUCTURED_POINTS are no mesh; convert them to UNSTRUCTURED_GRID, such as "
     "by ParaView's filter Tetrahedralize"},
    {"organ.vtu", kVtu, "NumberOfPoints=\"5\"", "NumberOfPoints=\"6\"",
     "organ.vtu:12: the file ends where a coordinate should be; export it again"},
    {"organ.vtu", kVtu, "NumberOfPoints=\"5\"", "NumberOfPoints=\"4\"",
     "organ.vtu:6: array 'Points' has more values than the mesh; export the file again"},
    {"organ.vtu", kVtu, "NumberOfPoints=\"5\"", "NumberOfPoints=\"9223372036854775808\"",
     "organ.vtu:4: NumberOfPoints is '9223372036854775808', where a count should be; export the file "
     "again"},
    {"organ.vtu", kVtu, "NumberOfCells=\"2\"", "NumberOfCells=\"-2\"",
     "organ.vtu:4: NumberOfCells is '-2', where a count should be; export the file again"},
    {"organ.vtu", kVtu, "\n1 2 3 4\n", "\n1 2 3 5\n",
     "organ.vtu:17: cell 1 names point 5, where points are 0 to 4; export the file again"},
    {"organ.vtu", kVtu, "4 8", "8 4", "organ.vtu:20: the offsets do not ascend; export the file again"},
    {"organ.vtu", kVtu, "Float64", "Float128",
     "organ.vtu:6: array 'Points' has the unknown type 'Float128'; export the file again"},
    {"organ.vtu", kVtu, "</Points>", "",
     "organ.vtu:26: is no complete XML (Start-end tags mismatch); copy or export it again"},
    {"organ.vtu", kVtu, "0.625", "&c;",
     "organ.vtu:11: '&c;' is no number, where a coordinate should be; correct it"},
    {"organ.vtu", kVtu, "Name=\"types\" format=\"ascii\"", "Name=\"types\" format=\"binary\"",
     "organ.vtu:22: array 'types' ends early; copy or export the file again"},
    {"organ.vtu", kVtu, "Name=\"offsets\" format=\"ascii\">\n4 8",
     "Name=\"offsets\" format=\"binary\">\nCAA?!",
     "organ.vtu:19: array 'offsets' ends early; copy or export the file again"},
    {"organ.vtu", kVtu, "Name=\"types\" format=\"ascii\"", "Name=\"types\" format=\"appended\" offset=\"0\"",
     "organ.vtu:22: array 'types' begins behind the end of the file; copy or export the file again"},
    {"organ.inp", kInp, "2, 2, 3, 4, 5", "2, 2, 3, 4, 6",
     "organ.inp:9: element 2 names node 6, which is not defined; define it with *NODE"},
    {"organ.inp", kInp, "2, 2, 3, 4, 5", "1, 2, 3, 4, 5",
     "organ.inp:9: element 1 is already defined at organ.inp:8; give one of them another label"},
    {"organ.inp", kInp, "5, 0.625", "4, 0.625",
     "organ.inp:6: node 4 is already defined at organ.inp:5; give one of them another label"},
    {"organ.inp", kInp, "1, 1, 2, 3, 4", "1, 0, 1, 2, 3",
     "organ.inp:8: 0 is not a node label; labels begin at 1"},
    {"organ.inp", kInp, "1, 1, 2, 3, 4", "1, 1, 2, 3, 2147483648",
     "organ.inp:8: '2147483648' is not a node label; write a whole number"},
    {"organ.inp", kInp, "C3D4", "C3D99",
     "organ.inp:7: elements of type C3D99 are not supported; mesh the body with tetrahedra, TYPE=C3D4, "
     "C3D10 or C3D10H"},
    {"organ.stl", kStl, "endfacet", "",
     "organ.stl:9: 'facet' stands where 'endfacet' should be; export the file again"},
    {"organ.stl", kStl, "vertex 1 0 0", "vertex 1 0",
     "organ.stl:6: 'vertex' is no number, where a coordinate should be; correct it"},
    {"organ.stl", kStl, "endsolid liver\n", "",
     "organ.stl:16: the file ends where endsolid should be; export it again"},
    {"organ.obj", kObj, "f 1 2 3", "f 0 1 2",
     "organ.obj:5: '0' is none of the 4 vertices above, which count from 1; export the file again"},
    {"organ.obj", kObj, "f 1 2 3", "f 1 2 5",
     "organ.obj:5: '5' is none of the 4 vertices above, which count from 1; export the file again"},
    {"organ.obj", kObj, "f 1 2 3", "f 1 2 2147483648",
     "organ.obj:5: '2147483648' is none of the 4 vertices above, which count from 1; export the file "
     "again"},
    {"organ.obj", kObj, "f 1 2 3", "f 1 2", "organ.obj:5: a face needs three vertices; remove it"},
    {"organ.obj", kObj, "v 0.625 1 1", "v 0.625 1",
     "organ.obj:4: the line ends where a coordinate should be; add it"},
    {"organ.ply", kPly, "vertex 4", "vertex 3",
     "organ.ply:13: '0.625' is no integer, where the size of a list should be; correct it"},
    {"organ.ply", kPly, "vertex 4", "vertex 5",
     "organ.ply:15: a face needs three vertices; remove it, or correct the counts of the elements"},
    {"organ.ply", kPly, "vertex 4", "vertex 2147483648",
     "organ.ply:3: 2147483648 is beyond 2147483647, where the number of elements should be; renumber the "
     "mesh, or export it again"},
    {"organ.ply", kPly, "3 1 2 3", "3 1 2 4",
     "organ.ply:15: a face names vertex 4, where vertices are 0 to 3; export the file again"},
    {"organ.ply", kPly, "3 1 2 3", "2000000000 1 2 3",
     "organ.ply:15: the file is too short for the 2000000000 numbers of a face; copy or export it again"},
    {"organ.ply", kPly, "property double x\n", "",
     "organ.ply:9: vertices have no properties x, y and z; export the file again"},
};

TEST_F(BadFiles, WrongCountsAndReferencesAreNamed) {
  for (const Damage& damage : kDamages)
    expect_refusal(damage.name, edited(damage.text, damage.from, damage.to), damage.message);
}

// Two tetrahedra, or two triangles, in a binary file.
std::string binary(const char* name) {
  const TempDir dir;
  MeshData mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.625, 1, 1}, {0, 0, 1}};
  const bool of_triangles = is_surface(name);
  mesh.cells = {of_triangles ? cell_of(CellKind::triangle, 0, {0, 1, 2})
                             : cell_of(CellKind::tetrahedron, 0, {0, 1, 2, 4}),
                of_triangles ? cell_of(CellKind::triangle, 0, {1, 2, 3})
                             : cell_of(CellKind::tetrahedron, 0, {1, 2, 4, 3})};
  if (of_triangles) mesh.positions.pop_back();
  number_from_one(mesh);
  write_mesh(mesh, {.is_binary = true}, dir.path() / name);
  return file_text(dir.path() / name);
}

template <typename Number>
std::string bytes_of_number(Number number, bool is_big) {
  std::string bytes(reinterpret_cast<const char*>(&number), sizeof number);
  if (is_big) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

TEST_F(BadFiles, BinaryFilesAreReadOrCutFilesRefused) {
  for (const char* name : {"organ.msh2", "organ.msh", "organ.vtk", "organ.vtu", "organ.stl", "organ.ply"}) {
    const std::string bytes = binary(name);
    expect_is_read(name, bytes);
    for (std::size_t part = 1; part < 20; ++part) refusal(name, bytes.substr(0, bytes.size() * part / 20));
  }
  expect_is_read("organ.stl", edited(binary("organ.stl"), "written", "solid w"));
}

struct BinaryDamage {
  const char* name;
  std::string from;
  std::string to;
  const char* message;
};

TEST_F(BadFiles, BinaryNumbersThatAreWrongAreNamed) {
  const auto big = [](auto number) { return bytes_of_number(number, true); };
  const auto little = [](auto number) { return bytes_of_number(number, false); };
  const double nan = std::nan(""), coordinate = 0.625;
  const BinaryDamage damages[] = {
      {"organ.msh2", little(coordinate), little(nan),
       "organ.msh2: byte 145: a coordinate is NaN; export the file again"},
      {"organ.msh2", "8\n" + little(1), "8\n" + big(1),
       "organ.msh2: byte 216: Gmsh's element type 67108864 is not supported; export the mesh with elements "
       "of order 1 or 2"},
      {"organ.msh2", "8\n" + little(1), "8\n" + little(7),
       "organ.msh2: byte 24: the byte order after the format is damaged; copy the file again, in binary"},
      {"organ.msh2", little(1) + little(2) + little(3) + little(5),
       little(0) + little(1) + little(2) + little(4),
       "organ.msh2: byte 252: node 0 is not among the nodes; export the file again, with all nodes"},
      {"organ.msh", little(coordinate), little(-HUGE_VAL),
       "organ.msh: byte 343: a coordinate is infinite; export the file again"},
      {"organ.msh", "$Nodes\n" + little(std::uint64_t{1}) + little(std::uint64_t{5}),
       "$Nodes\n" + little(std::uint64_t{1}) + little(std::uint64_t{1} << 63),
       "organ.msh: byte 187: 9.223372036854776e+18 is beyond 2147483647, where the number of nodes should "
       "be; renumber the mesh, or export it again"},
      {"organ.vtk", big(coordinate), big(nan),
       "organ.vtk: byte 175: point 3 has a coordinate that is no finite number; correct it"},
      {"organ.vtk", big(4) + big(0) + big(1) + big(2) + big(4),
       little(4) + little(0) + little(1) + little(2) + little(4),
       "organ.vtk: byte 231: cell 0 with 67108864 nodes passes the end of its section; export the file "
       "again, with the most significant byte first"},
      {"organ.vtk", big(1) + big(2) + big(4) + big(3), big(1) + big(2) + big(4) + big(5),
       "organ.vtk: byte 267: cell 1 names point 5, where points are 0 to 4; export the file again"},
      {"organ.vtu", little(coordinate), little(nan),
       "organ.vtu:10: point 3 has a coordinate that is no finite number; correct it"},
      {"organ.vtu", "LittleEndian", "BigEndian",
       "organ.vtu:10: array 'Points' has 8646911284551352320 bytes, where its values take 120; export the "
       "file again"},
      {"organ.vtu", "UInt64\">", "UInt32\">",
       "organ.vtu:14: 17179869184 is beyond 2147483647, where offsets should be; renumber the mesh, or "
       "export it again"},
      {"organ.stl", little(std::uint32_t{2}), little(std::uint32_t{0xffffffff}),
       "organ.stl: has 184 bytes, where its 4294967295 triangles take 214748364834; copy or export it again"},
      {"organ.stl", little(0.625f), little(static_cast<float>(nan)),
       "organ.stl: byte 174: triangle 2 has a coordinate that is no finite number; correct it"},
      {"organ.stl", little(std::uint32_t{2}), big(std::uint32_t{2}),
       "organ.stl: has 184 bytes, where its 33554432 triangles take 1677721684; copy or export it again"},
      {"organ.ply", little(coordinate), little(nan),
       "organ.ply: byte 279: vertex 3 has a coordinate that is no finite number; correct it"},
      {"organ.ply", "little_endian", "big_endian",
       "organ.ply: byte 301: a face names vertex 16777216, where vertices are 0 to 3; export the file again"},
      {"organ.ply", little(1) + little(2) + little(3), little(1) + little(2) + little(4),
       "organ.ply: byte 321: a face names vertex 4, where vertices are 0 to 3; export the file again"},
  };
  for (const BinaryDamage& damage : damages)
    expect_refusal(damage.name, edited(binary(damage.name), damage.from, damage.to), damage.message);
}

TEST_F(BadFiles, DamagedCompressionIsNamed) {
  const std::string bytes = from_base64(kRawZlibVtu);
  EXPECT_EQ(run_program({"check", dir_.write("organ.vtu", bytes).string()}).exit_code, 0);
  std::string damaged = bytes;
  damaged[damaged.rfind("x\x5e") + 6] ^= 0x55;
  expect_refusal(
      "organ.vtu", damaged,
      "organ.vtu:21: array 'types' has a damaged compressed block 1; copy or export the file again");
  expect_refusal(
      "organ.vtu", bytes.substr(0, bytes.size() - 60),
      "organ.vtu:21: array 'types' begins behind the end of the file; copy or export the file again");
  const std::string text = from_base64(kZlibVtu);
  std::string letters = text;
  letters[letters.rfind("</DataArray>") - 4] = '!';
  expect_refusal(
      "organ.vtu", letters,
      "organ.vtu:29: array 'types' has a letter that is not base64; copy or export the file again");
}

}  // namespace cli_bad_files_test
}  // namespace palpate::test
