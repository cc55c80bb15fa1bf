// The floating-point mode of the library while an object of this class lives: round to nearest, no traps,
// subnormal numbers become zero. An answer does not depend on the caller's mode, a NaN that came in raises no
// signal, and no frame meets subnormal numbers, on which some processors take a hundred times as long (a
// force of 1e-310 N is none). The caller's mode is put back, with the exception flags that it had.
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
