// Turns measurements into rows of a report: pushes, and methods at one |d|.
#pragma once

#include <string>
#include <vector>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/measured_push.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/study/organ_measurements.hpp"
#include "offline/study/report_pushes.hpp"

namespace palpate {

// A level with its rows: site and displacement of each push, without the errors of a method.
struct Level {
  LevelTruths truths;
  std::vector<PushRow> push_rows;
};

// A method's kind and name.
struct MethodName {
  MethodKind kind = MethodKind::linear;
  std::string name;
};

// Summarises the errors of a method over a level's pushes. Kind and times keep their defaults.
MethodRow method_row(const std::string& name, int contacts, const LevelTruths& level,
                     const std::vector<MeasuredPush>& pushes);

class ReportRows {
 public:
  // Adds rows to `report`. All arguments outlive the object.
  ReportRows(const OpenedPack& opened, const Organ& organ, OrganReport& report);

  // Describes the pushes of levels, which form the set `set`. Adds a note about pushes without a truth.
  std::vector<Level> describe_levels(const std::string& set, int contacts, std::vector<LevelTruths> levels);
  // Describes site and displacement of each push, common to all methods. `number`: the next PushRow::push.
  std::vector<PushRow> describe_pushes(const std::string& set, const std::vector<ContactTruth>& truths,
                                       int& number) const;
  // Adds a row to OrganReport::pushes for each push.
  void add_pushes(const std::vector<PushRow>& push_rows, const MethodName& method,
                  const std::vector<MeasuredPush>& pushes);
  // Adds a row without times to OrganReport::methods. Returns the row's index.
  size_t add_method(const MethodName& method, int contacts, const LevelTruths& level,
                    const std::vector<MeasuredPush>& pushes);

 private:
  const OpenedPack* opened_;
  const Organ* organ_;
  Surface surface_;
  OrganReport* report_;
};

}  // namespace palpate
