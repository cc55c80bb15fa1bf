// Draws the errors of a pack's models on the organ.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/opened_pack.hpp"

namespace palpate {

struct NodeErrors {
  std::string model;
  std::vector<double> largest;  // for each packed node: largest |u - u_FE| / |d|; empty: no push
};

// Draws the models with the largest and the smallest error, each with its own scale. Returns false and writes
// no file where the pack has no triangles or no errors. Throws std::runtime_error "PATH: REASON".
bool draw_error_map(const OpenedPack& opened, const Organ& organ, std::vector<NodeErrors> models,
                    const std::filesystem::path& png);

}  // namespace palpate
