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

// Truths of one |d|, with site and displacement of each push.
struct Level {
  LevelTruths truths;
  std::vector<PushRow> about;
};

// A method's kind and name.
struct MethodName {
  MethodKind kind = MethodKind::linear;
  std::string name;
};

// Summarises the errors of a method over a level's pushes; kind and times remain empty.
MethodRow method_row(const std::string& name, int contacts, const LevelTruths& level,
                     const std::vector<MeasuredPush>& pushes);

class ReportRows {
 public:
  // Adds rows to `report`. All arguments outlive the object.
  ReportRows(const OpenedPack& opened, const Organ& organ, OrganReport& report);

  // Describes levels whose pushes belong to `set`; adds a note about pushes without a truth.
  std::vector<Level> described(const std::string& set, int contacts, std::vector<LevelTruths> levels);
  // Describes site and displacement of each push, common to all methods; advances `number`.
  std::vector<PushRow> describe_pushes(const std::string& set, const std::vector<ContactTruth>& truths,
                                       int& number) const;
  void add_pushes(const std::vector<PushRow>& about, const MethodName& method,
                  const std::vector<MeasuredPush>& pushes);
  // Adds a row to OrganReport::methods; the times remain empty.
  size_t add_method(const MethodName& method, int contacts, const LevelTruths& level,
                    const std::vector<MeasuredPush>& pushes);

 private:
  const OpenedPack* opened_;
  const Organ* organ_;
  Surface surface_;
  OrganReport* report_;
};

}  // namespace palpate
