// VTU files for ParaView, read back byte by byte by a reader that knows the format and not the writer.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <span>
#include <stdexcept>

#include "offline/io/mesh_formats.hpp"

namespace palpate {
namespace vtu_writer_test {

std::filesystem::path scratch(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) / name;
}

constexpr WriteOptions kBinary = {.is_binary = true};

MeshData two_tetrahedra() {
  MeshData mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.1, 0.2, -1.0 / 3.0}};
  mesh.cells = {{CellKind::tetrahedron, 1, 4, {0, 1, 2, 3}, 0},
                {CellKind::tetrahedron, 2, 4, {0, 2, 1, 4}, 0}};
  mesh.point_arrays = {{"displacement", 3, {}}, {"node", 1, {11, 12, 13, 14, 1005}}};
  for (int i = 0; i < 14; ++i) mesh.point_arrays[0].values.push_back(std::sqrt(i) * 1e-3);
  mesh.point_arrays[0].values.push_back(std::numeric_limits<double>::quiet_NaN());
  mesh.cell_arrays = {{"material", 1, {0, 7}}};
  return mesh;
}

// The file's text up to the appended data, and the bytes after the underscore.
struct ReadFile {
  std::string xml, appended;

  explicit ReadFile(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    const std::string all(std::istreambuf_iterator<char>(in), {});
    const std::string marker = "<AppendedData encoding=\"raw\">\n_";
    const std::size_t place = all.find(marker);
    if (place == std::string::npos) throw std::runtime_error("no appended data");
    xml = all.substr(0, place);
    appended = all.substr(place + marker.size());
  }

  std::string attribute(const std::string& array, const std::string& attribute) const {
    const std::size_t name = xml.find("Name=\"" + array + "\"");
    if (name == std::string::npos) throw std::runtime_error("no array " + array);
    const std::size_t start = xml.rfind('<', name), end = xml.find("/>", name);
    const std::string element = xml.substr(start, end - start);
    const std::size_t place = element.find(" " + attribute + "=\"") + attribute.size() + 3;
    return element.substr(place, element.find('"', place) - place);
  }

  template <typename T>
  std::vector<T> values(const std::string& array) const {
    const std::size_t offset = std::stoull(attribute(array, "offset"));
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, appended.data() + offset, sizeof bytes);
    if (offset + sizeof bytes + bytes > appended.size())
      throw std::runtime_error("block reaches past the file");
    std::vector<T> values(bytes / sizeof(T));
    if (bytes > 0) std::memcpy(values.data(), appended.data() + offset + sizeof bytes, bytes);
    return values;
  }
};

TEST(VtuWriter, ReadsBackToTheBit) {
  const MeshData mesh = two_tetrahedra();
  const std::filesystem::path path = scratch("read_back.vtu");
  write_vtu(mesh, kBinary, path);
  const ReadFile file(path);
  EXPECT_NE(file.xml.find("<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
                          "header_type=\"UInt64\">"),
            std::string::npos);
  EXPECT_NE(file.xml.find("<Piece NumberOfPoints=\"5\" NumberOfCells=\"2\">"), std::string::npos);
  EXPECT_TRUE(file.appended.ends_with("</VTKFile>\n"));

  EXPECT_EQ(file.attribute("displacement", "type"), "Float64");
  EXPECT_EQ(file.attribute("displacement", "NumberOfComponents"), "3");
  EXPECT_EQ(file.attribute("displacement", "format"), "appended");
  std::vector<double> displacement = file.values<double>("displacement");
  ASSERT_EQ(displacement.size(), 15u);
  EXPECT_TRUE(std::isnan(displacement.back()));
  displacement.pop_back();
  EXPECT_TRUE(std::ranges::equal(displacement, std::span(mesh.point_arrays[0].values).first(14)));
  EXPECT_EQ(file.attribute("node", "type"), "Int32");
  EXPECT_EQ(file.values<int>("node"), (std::vector<int>{11, 12, 13, 14, 1005}));
  EXPECT_EQ(file.values<int>("material"), (std::vector<int>{0, 7}));

  std::vector<double> coordinates;
  for (const Eigen::Vector3d& point : mesh.positions)
    coordinates.insert(coordinates.end(), point.begin(), point.end());
  EXPECT_EQ(file.values<double>("Points"), coordinates);
  EXPECT_EQ(file.values<int>("connectivity"), (std::vector<int>{0, 1, 2, 3, 0, 2, 1, 4}));
  EXPECT_EQ(file.values<std::int64_t>("offsets"), (std::vector<std::int64_t>{4, 8}));
  EXPECT_EQ(file.values<std::uint8_t>("types"), (std::vector<std::uint8_t>{10, 10}));
  std::filesystem::remove(path);
}

TEST(VtuWriter, BothKindsOfTetrahedra) {
  MeshData mesh;
  for (int i = 0; i < 10; ++i) mesh.positions.emplace_back(i * 1.0, i * 0.5, 0);
  mesh.cells = {{CellKind::tetrahedron, 1, 4, {0, 1, 2, 3}, 0},
                {CellKind::tetrahedron, 2, 10, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, 0}};
  write_vtu(mesh, kBinary, scratch("kinds.vtu"));
  EXPECT_EQ(ReadFile(scratch("kinds.vtu")).values<std::uint8_t>("types"),
            (std::vector<std::uint8_t>{10, 24}));
  EXPECT_EQ(ReadFile(scratch("kinds.vtu")).values<std::int64_t>("offsets"),
            (std::vector<std::int64_t>{4, 14}));
  std::filesystem::remove(scratch("kinds.vtu"));
}

TEST(VtuWriter, FailureNamesPathAndReasonAndLeavesNothing) {
  try {
    write_vtu(two_tetrahedra(), kBinary, "/no/such/folder/result.vtu");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(
        std::string(error.what()),
        "/no/such/folder/result.vtu: cannot be written (No such file or directory); name another place");
  }
  // A link in place of the temporary file is replaced, not followed.
  const std::filesystem::path linked = scratch("vtu_writer_link");
  std::filesystem::create_directories(linked);
  const std::filesystem::path target = linked / "target";
  const std::filesystem::path planted = linked / ("result.vtu.unfinished-" + std::to_string(::getpid()));
  std::filesystem::create_symlink(target, planted);
  write_vtu(two_tetrahedra(), kBinary, linked / "result.vtu");
  EXPECT_FALSE(std::filesystem::exists(target));
  EXPECT_FALSE(std::filesystem::is_symlink(linked / "result.vtu"));
  std::filesystem::remove_all(linked);
  // A folder blocks the file's name: the rename fails and the temporary file must disappear.
  const std::filesystem::path folder = scratch("vtu_writer_folder");
  std::filesystem::create_directories(folder / "result.vtu" / "occupied");
  EXPECT_THROW(write_vtu(two_tetrahedra(), kBinary, folder / "result.vtu"), std::runtime_error);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator()),
            1);
  std::filesystem::remove_all(folder);
}

}  // namespace vtu_writer_test
}  // namespace palpate
