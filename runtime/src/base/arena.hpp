// Takes arrays from the caller's memory. A first run without memory counts the bytes, and a second run
// assigns the arrays. The same code does both, so that the count always matches.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace palpate {

class Arena {
 public:
  static constexpr size_t kAlignment = 64;

  explicit Arena(void* memory) : base_(static_cast<unsigned char*>(memory)) {}

  // Takes `count` elements that start on a cache line. Returns nullptr while counting.
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
