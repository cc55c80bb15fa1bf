// The content of a report page.
#pragma once

#include <string>
#include <vector>

#include "offline/study/organ_measurements.hpp"

namespace palpate {

struct Report {
  std::string processor;
  unsigned cores = 1;
  std::string compiler;
  std::string flags;
  std::string version;
  std::string commit;  // "" without a commit
  std::string date;    // UTC
  std::string command;
  long seed = 1;
  bool quick = false;
  double seconds = 0;
  std::vector<OrganReport> organs;
  bool is_kept() const {
    for (const OrganReport& organ : organs) {
      if (!organ.is_kept()) return false;
    }
    return true;
  }
};

}  // namespace palpate
