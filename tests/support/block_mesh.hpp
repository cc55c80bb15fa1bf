// Writes a block of tetrahedra of any size as the text of an .inp file.
#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>

namespace palpate::test {

// n^3 cells of five tetrahedra with four or ten nodes. Neighbouring cells are mirrored, so their faces match.
// Corner nodes have the same labels in both kinds; middle nodes follow them.
inline std::string block_inp(int n, bool ten_nodes = false) {
  std::string text = "*NODE, NSET=EVERY\n";
  const auto label = [&](int i, int j, int k) { return 1 + i + (n + 1) * (j + (n + 1) * k); };
  for (int k = 0; k <= n; ++k) {
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i) {
        text += std::to_string(label(i, j, k)) + ", " + std::to_string(0.125 * i) + ", " +
                std::to_string(0.125 * j) + ", " + std::to_string(0.125 * k) + "\n";
      }
    }
  }
  // Node index from twice the cell coordinates, which are integers for middle nodes too.
  const auto twice = [&](int node) {
    const int index = node - 1;
    return std::array<int, 3>{2 * (index % (n + 1)), 2 * (index / (n + 1) % (n + 1)),
                              2 * (index / (n + 1) / (n + 1))};
  };
  std::map<std::array<int, 3>, int> middles;
  std::string middle_text;
  std::string middle_base;
  const auto middle = [&](int a, int b) {
    std::array<int, 3> at = twice(a);
    for (std::size_t axis = 0; axis < 3; ++axis) at[axis] = (at[axis] + twice(b)[axis]) / 2;
    const auto [found, is_new] =
        middles.try_emplace(at, (n + 1) * (n + 1) * (n + 1) + 1 + static_cast<int>(middles.size()));
    if (is_new) {
      middle_text += std::to_string(found->second);
      for (const int coordinate : at) middle_text += ", " + std::to_string(0.0625 * coordinate);
      middle_text += "\n";
      if (at[2] == 0) middle_base += std::to_string(found->second) + "\n";
    }
    return found->second;
  };
  text += ten_nodes ? "*ELEMENT, TYPE=C3D10, ELSET=E\n" : "*ELEMENT, TYPE=C3D4, ELSET=E\n";
  int element = 0;
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        // Corners of the cell. Every second cell is mirrored in x, which inverts each tetrahedron.
        const bool mirrored = (i + j + k) % 2 != 0;
        std::array<int, 8> c{};
        for (std::size_t b = 0; b < 8; ++b) {
          const int x = static_cast<int>(b & 1U) ^ (mirrored ? 1 : 0);
          c[b] = label(i + x, j + static_cast<int>((b >> 1U) & 1U), k + static_cast<int>(b >> 2U));
        }
        const int tetrahedra[5][4] = {{0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}, {1, 2, 4, 7}};
        for (const auto& t : tetrahedra) {
          std::array<int, 4> nodes = {c[static_cast<std::size_t>(t[0])], c[static_cast<std::size_t>(t[1])],
                                      c[static_cast<std::size_t>(t[2])], c[static_cast<std::size_t>(t[3])]};
          if (mirrored) std::swap(nodes[2], nodes[3]);
          text += std::to_string(++element);
          for (const int node : nodes) text += ", " + std::to_string(node);
          if (ten_nodes) {
            constexpr std::size_t kEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
            for (const auto& edge : kEdges)
              text += ", " + std::to_string(middle(nodes[edge[0]], nodes[edge[1]]));
          }
          text += "\n";
        }
      }
    }
  }
  if (ten_nodes) text += "*NODE, NSET=EVERY\n" + middle_text + "*NSET, NSET=BASE\n" + middle_base;
  return text +
         "*MATERIAL, NAME=M\n*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n1, 4\n*SOLID SECTION, ELSET=E, "
         "MATERIAL=M\n"
         "*NSET, NSET=BASE, GENERATE\n1, " +
         std::to_string((n + 1) * (n + 1)) + "\n*BOUNDARY\nBASE, 1, 3\n";
}

}  // namespace palpate::test
