// Finds a point or a cell by its label in a file.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace palpate {

class LabelIndex {
 public:
  void add(int label, int index) { entries_.emplace_back(label, index); }

  // Ends the adding. Returns a label that was added twice, or nothing.
  std::optional<int> sort() {
    if (!std::is_sorted(entries_.begin(), entries_.end())) std::sort(entries_.begin(), entries_.end());
    const auto twice = std::adjacent_find(entries_.begin(), entries_.end(),
                                          [](const auto& a, const auto& b) { return a.first == b.first; });
    return twice == entries_.end() ? std::nullopt : std::optional<int>(twice->first);
  }

  // Returns the index behind a label, or nothing. Cost: O(1) for labels without gaps, else O(log labels).
  std::optional<int> find(int label) const {
    if (entries_.empty()) return std::nullopt;
    const std::int64_t guess = std::int64_t{label} - entries_.front().first;
    if (guess < 0) return std::nullopt;
    if (guess < static_cast<std::int64_t>(entries_.size())) {
      const auto& entry = entries_[static_cast<std::size_t>(guess)];
      if (entry.first == label) return entry.second;
    }
    const auto found = std::lower_bound(entries_.begin(), entries_.end(), label,
                                        [](const auto& entry, int sought) { return entry.first < sought; });
    if (found == entries_.end() || found->first != label) return std::nullopt;
    return found->second;
  }

 private:
  std::vector<std::pair<int, int>> entries_;  // (label, index)
};

}  // namespace palpate
