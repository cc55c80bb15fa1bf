// The methods that a report compares: what a pack carries, other settings of it, and what needs no pack.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "offline/cli/carried_scene.hpp"
#include "offline/cli/report_effort.hpp"
#include "offline/cli/study_packs.hpp"
#include "offline/report/report_data.hpp"

namespace palpate {

// A model of a pack, as a session answers it.
struct ComparedMethod {
  MethodKind kind = MethodKind::linear;
  std::string name;
  bool carried = false;  // by the pack that the report is about
  const OpenedPack* pack = nullptr;
  pal_model model = PAL_MODEL_LINEAR;
  std::uint32_t rings = 0;  // of a zone
};

// All models of an open pack, a zone with each number of its rings.
std::vector<ComparedMethod> carried_methods(const OpenedPack& opened);

// Other settings of polynomials and zones, at the sites of `study`, whose packs live as long as this.
class OtherSettings {
 public:
  // Rings that `opened` carries are left out; so are, with a note, polynomials that the organ's pushes do
  // not bear.
  OtherSettings(const OpenedPack& opened, const Organ& study, const ReportEffort& effort, int jobs,
                const SampleStore* store, std::vector<std::string>& notes);
  const std::vector<ComparedMethod>& methods() const { return methods_; }

 private:
  std::vector<std::unique_ptr<StudyPack>> packs_;
  std::vector<ComparedMethod> methods_;
};

// The organ again, touchable at so many of its sites far from one another; all of them where there are no more.
std::vector<size_t> compared_sites(const Organ& organ, int most);
LoadedScene with_sites(const Organ& organ, const std::vector<size_t>& sites);

}  // namespace palpate
