// The methods that a report compares: models of the pack, other settings of these models, and methods without a pack.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/study/organ_measurements.hpp"
#include "offline/study/report_effort.hpp"
#include "offline/study/report_rows.hpp"
#include "offline/study/study_packs.hpp"

namespace palpate {

// A model of a pack as a session evaluates it. `carried`: the reported pack carries the model; otherwise
// another setting.
struct ComparedMethod : MethodName {
  const OpenedPack* pack = nullptr;
  pal_model model = PAL_MODEL_LINEAR;
  std::uint32_t rings = 0;  // rings of a zone
  // Newton iterations in each frame of a zone with moving contacts; the error is then that of the arrival
  // frame. 0: the runtime's default, with the error of the converged response.
  std::uint32_t iterations = 0;
};

// Returns all models of an open pack, and a zone for each number of its rings.
std::vector<ComparedMethod> carried_methods(const OpenedPack& opened);

// Repeats the zones of `methods` with at most `most_rings` rings for each number of `iterations`, for moving contacts.
std::vector<ComparedMethod> moving_zones(const std::vector<ComparedMethod>& methods, int most_rings,
                                         const std::vector<int>& iterations);

// Other settings of polynomials and zones, and transferred polynomials, at `sites` of the organ. The object
// owns their packs.
class OtherSettings {
 public:
  // Leaves out rings that `opened` carries. Also leaves out, with a note:
  //   1. polynomials where the organ fails under their pushes,
  //   2. zones of small-strain elements that share their volume.
  OtherSettings(const OpenedPack& opened, const Organ& organ, const std::vector<size_t>& sites,
                const ReportEffort& effort, int jobs, const SampleStore* store,
                std::vector<std::string>& notes);
  // For each of `sites`: its number in the packs.
  const std::vector<std::uint32_t>& sites() const { return in_study_; }
  const std::vector<ComparedMethod>& methods() const { return methods_; }

 private:
  std::vector<std::uint32_t> in_study_;
  std::vector<std::unique_ptr<StudyPack>> packs_;
  std::vector<ComparedMethod> methods_;
};

}  // namespace palpate
