// Carves arrays out of the caller's memory. Run once with no memory it counts the bytes, run again it hands
// them out: the same code says how much is needed and uses it, so the two cannot disagree.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace palpate {

class Arena {
 public:
  static constexpr size_t kAlignment = 64;

  explicit Arena(void* memory) : base_(static_cast<unsigned char*>(memory)) {}

  // `count` elements on a cache line of their own; nullptr while counting.
  template <typename T>
  T* take(size_t count) {
    unsigned char* place = base_ == nullptr ? nullptr : base_ + used_;
    used_ += (count * sizeof(T) + kAlignment - 1) / kAlignment * kAlignment;
    return reinterpret_cast<T*>(place);
  }

  size_t used() const { return used_; }

 private:
  unsigned char* base_;
  size_t used_ = 0;
};

}  // namespace palpate
