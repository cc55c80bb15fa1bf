// Where on an organ a pack's models are wrong, as a picture.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/opened_pack.hpp"

namespace palpate {

// Of each packed node the largest |u - u_FE| / |d| over some pushes; empty: there were none.
struct NodeErrors {
  std::string model;
  std::vector<double> largest;
};

// The worst and the best of the models, each with its own scale. False, and no file, where the pack has no triangles or
// nothing was measured. Throws std::runtime_error "PATH: REASON" where it cannot be written.
bool draw_error_map(const OpenedPack& opened, const Organ& organ, std::vector<NodeErrors> models,
                    const std::filesystem::path& png);

}  // namespace palpate
