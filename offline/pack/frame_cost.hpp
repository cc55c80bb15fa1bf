// Counts the operations and bytes of a frame, the same on all machines. `palpate bench` measures times.
#pragma once

#include <cstdint>
#include <vector>

#include "offline/pack/pack_writer.hpp"

namespace palpate {

// Worst case of a frame with one contact at a site. A contact between sites costs up to three times as much.
struct FrameCost {
  SurveyedModel model = SurveyedModel::linear_dd;
  std::uint64_t force_operations = 0;  // multiply-adds
  std::uint64_t force_bytes = 0;       // read from the pack
  std::uint64_t field_operations = 0;
  std::uint64_t field_bytes = 0;
};

// Returns one entry for each model of the content.
std::vector<FrameCost> count_frame_costs(const PackContent& content);

}  // namespace palpate
