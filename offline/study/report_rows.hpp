// What was measured, as rows of a report: pushes, and methods at one |d|.
#pragma once

#include <string>
#include <vector>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/measured_push.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/study/organ_measurements.hpp"
#include "offline/study/report_pushes.hpp"

namespace palpate {

// With where and how far each of its pushes goes.
struct Level {
  LevelTruths truths;
  std::vector<PushRow> about;
  // The first so many pushes, or all.
  Level first(int count) const;
};

// What a method is called, and which one it is.
struct MethodName {
  MethodKind kind = MethodKind::linear;
  std::string name;
  bool carried = false;
};

// One method over the pushes of a level; its times are another's to fill in.
MethodRow method_row(const MethodName& method, int contacts, const LevelTruths& level,
                     const std::vector<MeasuredPush>& pushes);

class ReportRows {
 public:
  // Adds to `report`; all outlive it.
  ReportRows(const OpenedPack& opened, const Organ& organ, OrganReport& report);

  // Levels whose pushes are `set` in tables; notes those without a truth.
  std::vector<Level> described(const std::string& set, int contacts, std::vector<LevelTruths> levels);
  // Where and how far, for all methods alike; counts them in `number`.
  std::vector<PushRow> describe_pushes(const std::string& set, const std::vector<ContactTruth>& truths,
                                       int& number) const;
  void add_pushes(const std::vector<PushRow>& about, const MethodName& method,
                  const std::vector<MeasuredPush>& pushes);
  // A row of OrganReport::methods, whose times are another's to fill in.
  size_t add_method(const MethodName& method, int contacts, const LevelTruths& level,
                    const std::vector<MeasuredPush>& pushes);
  OrganReport& report() { return *report_; }

 private:
  const OpenedPack* opened_;
  const Organ* organ_;
  Surface surface_;
  OrganReport* report_;
};

}  // namespace palpate
