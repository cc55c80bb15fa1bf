// Meshes of several blocks with their own nodes, in memory and as the text of an .inp file.
#pragma once

#include <fmt/format.h>

#include <string>

#include "tests/support/tetrahedral_block.hpp"

namespace palpate::test {

// A block without jitter and with its first corner at `corner`.
inline Model block_at(const Eigen::Vector3d& corner, const std::array<int, 3>& cells,
                      const Eigen::Vector3d& size) {
  BlockShape shape;
  shape.cells = cells;
  shape.size = size;
  shape.jitter = 0;
  Model model = tetrahedral_block(shape);
  const Eigen::Vector3d cell = size.cwiseQuotient(Eigen::Vector3d(cells[0], cells[1], cells[2]));
  for (Eigen::Vector3d& position : model.positions)  // tetrahedral_block() rounds to 2^-20 of the size
    position = corner + position.cwiseQuotient(cell).array().round().matrix().cwiseProduct(cell);
  return model;
}

// Adds a part with its own nodes, whose labels begin above 1000, 2000, ...
inline Model with_part(Model model, const Model& part) {
  const int first = model.num_nodes();
  const int label = 1000 * (1 + (model.labels.back() - 1) / 1000);
  for (int node = 0; node < part.num_nodes(); ++node) {
    model.positions.push_back(part.positions[static_cast<std::size_t>(node)]);
    model.labels.push_back(label + part.labels[static_cast<std::size_t>(node)]);
    model.label_index.emplace_back(model.labels.back(), first + node);
  }
  const int element_label = model.elements.back().label;
  for (Tetrahedron element : part.elements) {
    element.label += element_label;
    for (int& node : element.nodes()) node += first;
    model.elements.push_back(element);
  }
  return model;
}

// A block of 3 x 3 x 3 unit cells without its inner cell.
inline Model hollow_block() {
  Model model = block_at({0, 0, 0}, {3, 3, 3}, {3, 3, 3});
  constexpr int kInnerCell = 1 + 3 * (1 + 3 * 1);
  model.elements.erase(model.elements.begin() + 6 * kInnerCell,
                       model.elements.begin() + 6 * (kInnerCell + 1));
  return model;
}

// Two blocks of 3 x 3 x 2 unit cells, one on the other. Each has its own nodes at z = 2.
inline Model stacked_blocks() {
  return with_part(block_at({0, 0, 0}, {3, 3, 2}, {3, 3, 2}), block_at({0, 0, 2}, {3, 3, 2}, {3, 3, 2}));
}

// The model as text, fixed at the nodes of `base` (node indices). The sets are EVERY and BASE.
inline std::string inp_of(const Model& model, const std::vector<int>& base) {
  std::string text = "*NODE, NSET=EVERY\n";
  for (int node = 0; node < model.num_nodes(); ++node) {
    const Eigen::Vector3d& at = model.positions[static_cast<std::size_t>(node)];
    text += fmt::format("{}, {:.17g}, {:.17g}, {:.17g}\n", model.labels[static_cast<std::size_t>(node)],
                        at.x(), at.y(), at.z());
  }
  text += "*ELEMENT, TYPE=C3D4, ELSET=E\n";
  for (const Tetrahedron& element : model.elements) {
    text += std::to_string(element.label);
    for (const int node : element.nodes())
      text += fmt::format(", {}", model.labels[static_cast<std::size_t>(node)]);
    text += "\n";
  }
  text += "*NSET, NSET=BASE\n";
  for (const int node : base) text += fmt::format("{}\n", model.labels[static_cast<std::size_t>(node)]);
  return text +
         "*MATERIAL, NAME=M\n*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n1, 4\n*SOLID SECTION, ELSET=E, "
         "MATERIAL=M\n*BOUNDARY\nBASE, 1, 3\n";
}

}  // namespace palpate::test
