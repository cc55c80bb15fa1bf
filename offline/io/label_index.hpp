// Finds a point or a cell by its label in a file.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

namespace palpate {

// Labels in a row with indices in a row take one entry together, so a usual mesh takes next to no memory.
class LabelIndex {
 public:
  void add(int label, int index) {
    if (!runs_.empty()) {
      Run& last = runs_.back();
      if (label == last.label + last.size && index == last.index + last.size) {
        ++last.size;
        return;
      }
    }
    runs_.push_back({label, index});
  }

  // Ends the adding. Returns a label that was added twice, or nothing.
  std::optional<int> sort() {
    std::ranges::sort(runs_, {}, &Run::label);
    for (std::size_t i = 1; i < runs_.size(); ++i) {
      if (runs_[i].label < runs_[i - 1].label + runs_[i - 1].size) return runs_[i].label;
    }
    return std::nullopt;
  }

  // Returns the index behind a label, or nothing. Cost: O(log runs).
  std::optional<int> find(int label) const {
    auto run = std::ranges::upper_bound(runs_, std::int64_t{label}, {}, &Run::label);
    if (run == runs_.begin()) return std::nullopt;
    --run;
    const std::int64_t offset = label - run->label;
    if (offset >= run->size) return std::nullopt;
    return static_cast<int>(run->index + offset);
  }

 private:
  struct Run {
    std::int64_t label;
    int index;
    int size = 1;
  };
  std::vector<Run> runs_;
};

}  // namespace palpate
