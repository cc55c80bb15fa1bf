// The text of an .inp file with a block of tetrahedra of any size.
#pragma once

#include <array>
#include <string>
#include <utility>

namespace palpate::test {

// A block of n^3 cells of five tetrahedra each, alternately mirrored so that their faces match.
inline std::string block_inp(int n) {
  std::string text = "*NODE\n";
  const auto label = [&](int i, int j, int k) { return 1 + i + (n + 1) * (j + (n + 1) * k); };
  for (int k = 0; k <= n; ++k) {
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i) {
        text += std::to_string(label(i, j, k)) + ", " + std::to_string(0.125 * i) + ", " +
                std::to_string(0.125 * j) + ", " + std::to_string(0.125 * k) + "\n";
      }
    }
  }
  text += "*ELEMENT, TYPE=C3D4, ELSET=E\n";
  int element = 0;
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        // Corners of the cell; in every second one mirrored in x, which turns each tetrahedron inside out.
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
          text += "\n";
        }
      }
    }
  }
  return text +
         "*MATERIAL, NAME=M\n*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n1, 4\n*SOLID SECTION, ELSET=E, "
         "MATERIAL=M\n"
         "*NSET, NSET=BASE, GENERATE\n1, " +
         std::to_string((n + 1) * (n + 1)) + "\n*BOUNDARY\nBASE, 1, 3\n";
}

}  // namespace palpate::test
