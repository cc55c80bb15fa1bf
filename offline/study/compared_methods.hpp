// The methods that a report compares: what a pack carries, other settings of it, and what needs no pack.
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

// A model of a pack, as a session answers it; carried by the pack that the report is about (of several contacts in zones
// of fewer rings by one of no more rings, if there is a note), or another setting.
struct ComparedMethod : MethodName {
  const OpenedPack* pack = nullptr;
  pal_model model = PAL_MODEL_LINEAR;
  std::uint32_t rings = 0;  // of a zone
  // Of a frame of a zone whose contacts move: the answer is that of the frame in which they arrive. 0: as many as the
  // runtime takes, and the answer that the zone comes to rest at.
  std::uint32_t iterations = 0;
};

// All models of an open pack, a zone with each number of its rings.
std::vector<ComparedMethod> carried_methods(const OpenedPack& opened);

// The zones among `methods` of so many rings again, with each of these numbers of iterations in a frame, while
// contacts move.
std::vector<ComparedMethod> moving_zones(const std::vector<ComparedMethod>& methods, int most_rings,
                                         const std::vector<int>& iterations);

// Other settings of polynomials and zones, and polynomials moved from other sites, at `sites` of the organ; their
// packs, whose sites are those of `study`, live as long as this.
class OtherSettings {
 public:
  // Rings that `opened` carries are left out; so are, with a note, polynomials that the organ's pushes do
  // not bear, and zones of elements that share their volume at small strain.
  OtherSettings(const OpenedPack& opened, const Organ& organ, const std::vector<size_t>& sites,
                const ReportEffort& effort, int jobs, const SampleStore* store,
                std::vector<std::string>& notes);
  // By the organ's numbers, of those sites: the number in the packs.
  const std::vector<std::uint32_t>& sites() const { return in_study_; }
  const std::vector<ComparedMethod>& methods() const { return methods_; }

 private:
  std::vector<std::uint32_t> in_study_;
  std::vector<std::unique_ptr<StudyPack>> packs_;
  std::vector<ComparedMethod> methods_;
};

}  // namespace palpate
