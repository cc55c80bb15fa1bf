// A mesh in the terms of Gmsh: each cell is in an elementary entity, and entities are in physical groups.
// Cells of equal dimension in equal sets share an entity. Point elements carry the node sets.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "offline/io/gmsh_cells.hpp"
#include "offline/io/mesh_data.hpp"

namespace palpate {

struct GmshRow {
  int label = 0;
  const GmshType* type = nullptr;
  int entity = 0;  // number within its dimension, from 1
  int cell = -1;   // index of the cell, or -1: the point element of `node`
  int node = -1;
};

struct GmshEntity {
  std::vector<int> groups;  // numbers of physical groups
  int node = 0;             // the first node of the entity; the place of a point
};

struct GmshLayout {
  std::vector<int> node_labels;
  std::vector<GmshRow> rows;                         // in the order of the cells, then the point elements
  std::array<std::vector<GmshEntity>, 4> entities;   // by dimension
  std::array<std::map<std::string, int>, 4> groups;  // by dimension: name -> number
  int largest_label = 0;                             // of the rows

  const GmshEntity& entity_of(const GmshRow& row) const {
    return entities[static_cast<std::size_t>(dimension(row.type->kind))]
                   [static_cast<std::size_t>(row.entity - 1)];
  }
};

GmshLayout lay_out(const MeshData& mesh);

}  // namespace palpate
