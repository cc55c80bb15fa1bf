// A damaged mesh file takes at most twice its own size in memory, in each format.
#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <string>

#include "offline/io/mesh_formats.hpp"
#include "offline/mesh/input_error.hpp"
#include "tests/support/mesh_files.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {
namespace reader_memory_test {

// A figure of /proc/self/status, in KiB.
long status(const std::string& name) {
  std::ifstream stream("/proc/self/status");
  for (std::string word; stream >> word;) {
    long number = 0;
    if (word == name + ":" && stream >> number) return number;
  }
  return -1;
}

struct Reading {
  long peak_kib = -1;  // above the memory before
  bool is_refused = false;
};

// Reads the file in a child, whose peak starts from the memory that it has. wait4() would count the parent's.
Reading read_in_child(const std::filesystem::path& file) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("cannot make a pipe");
  const pid_t child = fork();
  if (child == 0) {
    malloc_trim(0);
    std::ofstream("/proc/self/clear_refs") << "5";
    const long before = status("VmHWM");
    Reading reading;
    try {
      read_mesh(file);
    } catch (const InputError&) {
      reading.is_refused = true;
    }
    reading.peak_kib = status("VmHWM") - before;
    _exit(write(ends[1], &reading, sizeof reading) == sizeof reading ? 0 : 1);
  }
  close(ends[1]);
  Reading reading;
  EXPECT_EQ(read(ends[0], &reading, sizeof reading), static_cast<ssize_t>(sizeof reading));
  close(ends[0]);
  waitpid(child, nullptr, 0);
  return reading;
}

constexpr int kSide = 48;  // points along an edge of the cube

int point(int x, int y, int z) {
  return (z * kSide + y) * kSide + x;
}

// A cube with six tetrahedra in each cell of a grid.
MeshData cube_of_tetrahedra() {
  MeshData mesh;
  for (int i = 0; i < kSide * kSide * kSide; ++i)
    mesh.positions.emplace_back(0.123456 * (i % kSide), 0.234567 * (i / kSide % kSide),
                                0.345678 * (i / kSide / kSide));
  constexpr int kPaths[6][2] = {{1, 3}, {3, 2}, {2, 6}, {6, 4}, {4, 5}, {5, 1}};  // corners between 0 and 7
  for (int z = 0; z + 1 < kSide; ++z) {
    for (int y = 0; y + 1 < kSide; ++y) {
      for (int x = 0; x + 1 < kSide; ++x) {
        const auto corner = [&](int i) { return point(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2)); };
        for (const auto& path : kPaths)
          mesh.cells.push_back(
              cell_of(CellKind::tetrahedron, 0, {corner(0), corner(path[0]), corner(path[1]), corner(7)}));
      }
    }
  }
  mesh.point_arrays = {{"u", 3, std::vector<double>(3 * mesh.positions.size(), 0.5)}};
  number_from_one(mesh);
  return mesh;
}

// The surface formats get each face of each cell.
MeshData many_triangles() {
  const MeshData solid = cube_of_tetrahedra();
  MeshData mesh;
  mesh.positions = solid.positions;
  for (const MeshCell& cell : solid.cells)
    mesh.cells.push_back(cell_of(CellKind::triangle, 0, {cell.nodes[0], cell.nodes[1], cell.nodes[2]}));
  number_from_one(mesh);
  return mesh;
}

struct Case {
  const char* name;
  bool is_binary;
  bool is_surface;
};

// Damages the last number or byte that matters: the reader finds out when it has seen nearly all.
void damage_end(const std::filesystem::path& file, bool is_binary) {
  std::filesystem::path damaged = file;
  if (file.extension() == ".node") damaged.replace_extension(".ele");
  const std::uintmax_t size = std::filesystem::file_size(damaged);
  if (is_binary && file.extension() == ".stl") {  // its size must fit, so a coordinate becomes NaN
    std::fstream stream(damaged, std::ios::binary | std::ios::in | std::ios::out);
    stream.seekp(static_cast<std::streamoff>(size - 14));
    stream << "\xff\xff\xff\xff";
    return;
  }
  std::filesystem::resize_file(damaged, size - 100);
  std::ofstream(damaged, std::ios::binary | std::ios::app) << "\nf 1 2 no_number\n";
}

void expect_little_memory(const Case& one) {
  const TempDir dir;
  const std::filesystem::path file = dir.path() / one.name;
  {
    const MeshData mesh = one.is_surface ? many_triangles() : cube_of_tetrahedra();
    write_mesh(mesh, {.is_binary = one.is_binary}, file);
  }
  std::size_t size = std::filesystem::file_size(file);
  if (file.extension() == ".node") size += std::filesystem::file_size(dir.path() / "organ.ele");
  ASSERT_GT(size, 5'000'000U);
  const Reading intact = read_in_child(file);
  EXPECT_FALSE(intact.is_refused);
  damage_end(file, one.is_binary);
  const Reading damaged = read_in_child(file);
  EXPECT_TRUE(damaged.is_refused);
  constexpr long kFixedKib = 4096;
  const long size_kib = static_cast<long>(size / 1024);
  EXPECT_LE(damaged.peak_kib, 2 * size_kib + kFixedKib);
  EXPECT_GT(damaged.peak_kib, size_kib / 2) << "the peak is not measured";
  std::printf("%-12s %6ld KiB, damaged %.2f times, intact %.2f times\n", one.name, size_kib,
              static_cast<double>(damaged.peak_kib) / static_cast<double>(size_kib),
              static_cast<double>(intact.peak_kib) / static_cast<double>(size_kib));
}

TEST(ReaderMemory, ADamagedFileTakesAtMostTwiceItsSize) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer keeps freed memory";
  const Case cases[] = {
      {"organ.msh1", false, false}, {"organ.msh2", false, false}, {"organ.msh2", true, false},
      {"organ.msh4", false, false}, {"organ.msh4", true, false},  {"organ.mesh", false, false},
      {"organ.node", false, false}, {"organ.vtk", false, false},  {"organ.vtk", true, false},
      {"organ.vtu", false, false},  {"organ.vtu", true, false},   {"organ.inp", false, false},
      {"organ.stl", false, true},   {"organ.stl", true, true},    {"organ.obj", false, true},
      {"organ.ply", false, true},   {"organ.ply", true, true}};
  for (const Case& one : cases) {
    SCOPED_TRACE(std::string(one.name) + (one.is_binary ? ", binary" : ", text"));
    expect_little_memory(one);
  }
}

}  // namespace reader_memory_test
}  // namespace palpate::test
