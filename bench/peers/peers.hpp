// The pages of the study of linear organs.
#pragma once

#include <filesystem>
#include <vector>

#include "bench/peers/linear_organ.hpp"
#include "bench/solver/study_table.hpp"

namespace palpate::peers {

// The middle node of the patch that models/brain/brain_push.inp pushes.
constexpr int kPushedLabel = 936;

// The effort of the study. `patient` takes more measurements, with more frames each.
struct Study {
  bool patient = false;
};

// linear_dd on the brain, with any surface node as a contact: forces, fields, joining and leaving contacts.
std::vector<study::StudyTable> brain_frames_page(const LinearOrgan& brain, const Study& study);
// Every method, over mesh sizes and numbers of contacts.
std::vector<study::StudyTable> linear_frames_page(const Study& study);
// The paper's operation counts and our times, at the size of its table 1.
std::vector<study::StudyTable> operation_counts_page(const LinearOrgan& brain, const Study& study);
// The paper's figure 6: prepared at S, touched at T. Draws the figure into `pictures`.
std::vector<study::StudyTable> touched_elsewhere_page(const LinearOrgan& brain,
                                                      const std::filesystem::path& pictures);

}  // namespace palpate::peers
