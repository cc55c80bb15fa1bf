// Small sound text files of every mesh format, for tests that damage them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate::test {

// A file of two tetrahedra, or of two triangles. 0.625 stands in it once, as a coordinate.
struct SoundFile {
  const char* name;
  std::string text;
  const char* comment;  // a line that the format passes over; "": none
};

inline const std::string kPoints = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n0.625 1 1\n";

inline std::string numbered(const std::string& behind) {
  return "1 0 0 0" + behind + "2 1 0 0" + behind + "3 0 1 0" + behind + "4 0 0 1" + behind + "5 0.625 1 1" +
         behind;
}

inline const std::string kGmsh2 =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n" + numbered("\n") +
    "$EndNodes\n$Elements\n2\n1 4 2 0 1 1 2 3 4\n2 4 2 0 1 2 3 4 5\n$EndElements\n";
inline const std::string kGmsh4 =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n" + kPoints +
    "$EndNodes\n$Elements\n1 2 1 2\n3 1 4 2\n1 1 2 3 4\n2 2 3 4 5\n$EndElements\n";
inline const std::string kMedit =
    "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0.625 1 1 0\n"
    "Tetrahedra\n2\n1 2 3 4 0\n2 3 4 5 0\nEnd\n";
inline const std::string kVtk =
    "# vtk DataFile Version 4.2\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n" + kPoints +
    "CELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 2\n10\n10\n";
inline const std::string kVtu =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\">\n<UnstructuredGrid>\n"
    "<Piece NumberOfPoints=\"5\" NumberOfCells=\"2\">\n<Points>\n"
    "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n" +
    kPoints +
    "</DataArray>\n</Points>\n<Cells>\n<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">\n"
    "0 1 2 3\n1 2 3 4\n</DataArray>\n<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">\n4 8\n"
    "</DataArray>\n<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">\n10 "
    "10\n</DataArray>\n</Cells>\n"
    "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
inline const std::string kInp =
    "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n5, 0.625, 1, 1\n"
    "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n2, 2, 3, 4, 5\n";
inline const std::string kElements = "2 4 0\n1 1 2 3 4\n2 2 3 4 5\n";

inline std::string stl_facet(const std::string& last) {
  return "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex " + last +
         "\nendloop\nendfacet\n";
}

inline const std::string kStl =
    "solid liver\n" + stl_facet("0 1 0") + stl_facet("0.625 1 1") + "endsolid liver\n";
inline const std::string kObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0.625 1 1\nf 1 2 3\nf 2 3 4\n";
inline const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n0.625 1 1\n3 0 1 2\n3 1 2 3\n";

inline const std::vector<SoundFile>& sound_files() {
  static const std::vector<SoundFile> files = {
      {"organ.msh1",
       "$NOD\n5\n" + numbered("\n") + "$ENDNOD\n$ELM\n2\n1 4 0 1 4 1 2 3 4\n2 4 0 1 4 2 3 4 5\n$ENDELM\n",
       "$Comments\nbl\xe4ttchen\n$EndComments\n"},
      {"organ.msh2", kGmsh2, "$Comments\nbl\xe4ttchen\n$EndComments\n"},
      {"organ.msh", kGmsh4, "$Comments\nbl\xe4ttchen\n$EndComments\n"},
      {"organ.mesh", kMedit, "# bl\xe4ttchen\n"},
      {"organ.node", "5 3 0 0\n" + numbered("\n"), "# bl\xe4ttchen\n"},
      {"organ.vtk", kVtk, ""},
      {"organ.vtu", kVtu, ""},
      {"organ.inp", kInp, "** bl\xe4ttchen\n"},
      {"organ.stl", kStl, ""},
      {"organ.obj", kObj, "# bl\xe4ttchen\n"},
      {"organ.ply", kPly, ""},
  };
  return files;
}

inline bool is_surface(const std::filesystem::path& file) {
  return file.extension() == ".stl" || file.extension() == ".obj" || file.extension() == ".ply";
}

}  // namespace palpate::test
