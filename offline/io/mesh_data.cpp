#include "offline/io/mesh_data.hpp"

#include <algorithm>
#include <numeric>

namespace palpate {
namespace {

struct KindFacts {
  const char* plural;
  int num_corners;
  int dimension;
};

// In the order of CellKind.
constexpr std::array<KindFacts, 8> kKinds = {{{"points", 1, 0},
                                              {"lines", 2, 1},
                                              {"triangles", 3, 2},
                                              {"quadrilaterals", 4, 2},
                                              {"tetrahedra", 4, 3},
                                              {"pyramids", 5, 3},
                                              {"wedges", 6, 3},
                                              {"hexahedra", 8, 3}}};

const KindFacts& facts(CellKind kind) {
  return kKinds[static_cast<std::size_t>(kind)];
}

}  // namespace

const char* plural_name(CellKind kind) {
  return facts(kind).plural;
}

int num_corners(CellKind kind) {
  return facts(kind).num_corners;
}

int dimension(CellKind kind) {
  return facts(kind).dimension;
}

void number_from_one(MeshData& mesh) {
  mesh.node_labels.resize(mesh.positions.size());
  std::iota(mesh.node_labels.begin(), mesh.node_labels.end(), 1);
  for (std::size_t i = 0; i < mesh.cells.size(); ++i) mesh.cells[i].label = static_cast<int>(i) + 1;
}

void sort_sets(std::map<std::string, std::vector<int>>& sets) {
  for (auto& [name, set] : sets) {
    std::sort(set.begin(), set.end());
    set.erase(std::unique(set.begin(), set.end()), set.end());
  }
}

}  // namespace palpate
