// What a frame costs, counted from what the runtime reads and multiplies: the same on every machine, so that
// a pack does not depend on where it was built. `palpate bench` measures the nanoseconds.
#pragma once

#include <cstdint>
#include <vector>

#include "offline/pack/pack_writer.hpp"

namespace palpate {

// Worst case of one frame with one contact at a site; between sites it is that of up to three.
struct FrameCost {
  SurveyedModel model = SurveyedModel::linear_dd;
  std::uint64_t force_operations = 0;  // multiply-adds
  std::uint64_t force_bytes = 0;       // read from the pack
  std::uint64_t field_operations = 0;
  std::uint64_t field_bytes = 0;
};

// One entry for each model that the content carries.
std::vector<FrameCost> count_frame_costs(const PackContent& content);

}  // namespace palpate
