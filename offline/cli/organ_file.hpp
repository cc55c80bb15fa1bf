// Reads an organ from any mesh format for `palpate check` and `palpate new`.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "offline/io/element_moduli.hpp"
#include "offline/mesh/model.hpp"

namespace palpate {

struct OrganOptions {
  double scale = 1;           // multiplies all positions
  double merge_length = 0;    // nodes closer than this after scaling become one; 0: none
  bool keep_largest = false;  // drop all parts but the one with the most elements
};

struct OrganFile {
  // The tetrahedra, with the materials and supports that an .inp file has. Elements without a material have
  // -1. Arrays E and nu of other files are in `moduli`.
  Model model;
  ElementModuli moduli;             // of the arrays; see find_element_moduli(), with E = 1 and kTissueRatio
  std::vector<std::string> faults;  // a line: why materials and supports of an .inp file could not be read

  bool has_laws = false;  // every element has a material from an .inp file
  // The file is a whole model, on which a scene can stand.
  bool is_deck() const { return has_laws && !model.fixed.empty(); }
};

// Throws InputError where the file has no tetrahedra or cannot be read. Model::warnings has a line
// for each repair.
OrganFile read_organ(const std::filesystem::path& file, const OrganOptions& options);

}  // namespace palpate
