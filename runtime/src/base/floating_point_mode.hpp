// Sets the library's floating-point mode during the lifetime of an object: round to nearest, no traps, flush
// subnormal numbers to zero. The destructor restores the caller's mode and exception flags. Hence:
// - An answer does not depend on the caller's mode.
// - A NaN input raises no signal.
// - No frame computes with subnormal numbers, which are slow on some processors.
#pragma once

#include <stdint.h>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace palpate {

class FloatingPointMode {
 public:
#if defined(__SSE2__)
  FloatingPointMode() : mode_(_mm_getcsr()) {
    _mm_setcsr(kDefault | kFlushResults | kFlushOperands);
  }
  ~FloatingPointMode() {
    _mm_setcsr(mode_);
  }
#elif defined(__aarch64__)
  FloatingPointMode() {
    __asm__ volatile("mrs %0, fpcr" : "=r"(mode_));
    __asm__ volatile("msr fpcr, %0" : : "r"(kFlush));
  }
  ~FloatingPointMode() {
    __asm__ volatile("msr fpcr, %0" : : "r"(mode_));
  }
#endif
  FloatingPointMode(const FloatingPointMode&) = delete;
  FloatingPointMode& operator=(const FloatingPointMode&) = delete;

 private:
#if defined(__SSE2__)
  static constexpr uint32_t kDefault = 0x1f80;  // all exceptions masked
  static constexpr uint32_t kFlushResults = 0x8000;
  static constexpr uint32_t kFlushOperands = 0x0040;
  uint32_t mode_;
#elif defined(__aarch64__)
  static constexpr uint64_t kFlush = uint64_t{1} << 24;
  uint64_t mode_ = 0;
#else
#error "say how this processor flushes subnormal numbers"
#endif
};

}  // namespace palpate
