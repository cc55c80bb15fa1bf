// Gathers the refusals of a file, which its reader throws together.
#pragma once

#include <string>

#include "offline/mesh/input_error.hpp"

namespace palpate {

class Refusals {
 public:
  void add(const InputError& error) {
    if (count_ < kShown) lines_ += (count_ > 0 ? "\n" : "") + std::string(error.what());
    ++count_;
  }
  bool empty() const { return count_ == 0; }
  // Whether the reading should end: a file with so many refusals is no model.
  bool full() const { return count_ >= kMost; }

  // Throws InputError with a line for each refusal, unless there is none.
  void throw_if_any() const {
    if (empty()) return;
    std::string more;
    if (count_ > kShown) more = "\nand " + std::to_string(count_ - kShown) + " more";
    if (full()) more += ", where the reading ended";
    throw InputError(lines_ + more);
  }

 private:
  static constexpr int kShown = 20;
  static constexpr int kMost = 1000;
  std::string lines_;
  int count_ = 0;
};

}  // namespace palpate
