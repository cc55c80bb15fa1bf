// The pages of the study of linear organs.
#pragma once

#include <filesystem>
#include <vector>

#include "bench/peers/linear_organ.hpp"
#include "bench/solver/study_table.hpp"

namespace palpate::peers {

// Of the node in the middle of the patch that models/brain/brain_push.inp pushes.
constexpr int kPushedLabel = 936;

// With `patient` each measurement takes more frames, and there are more of them.
struct Study {
  bool patient = false;
};

// linear_dd on the brain, any node of the surface a contact: forces, fields, contacts that come and go.
std::vector<study::StudyTable> brain_frames_page(const LinearOrgan& brain, const Study& study);
// Every method over sizes of the mesh and numbers of contacts.
std::vector<study::StudyTable> linear_frames_page(const Study& study);
// What the paper counts and what it takes, at the size of its table 1.
std::vector<study::StudyTable> operation_counts_page(const LinearOrgan& brain, const Study& study);
// The paper's figure 6: touched at T, prepared at S. Draws it into `pictures`.
std::vector<study::StudyTable> touched_elsewhere_page(const LinearOrgan& brain,
                                                      const std::filesystem::path& pictures);

}  // namespace palpate::peers
