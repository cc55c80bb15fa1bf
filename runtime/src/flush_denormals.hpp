// Round to nearest, no traps, and subnormal numbers become zero while an object of this class lives: answers
// do not depend on the caller's mode, a NaN that came in is no signal, and arithmetic on them takes a hundred
// times as long on some processors, and a force of 1e-310 N is none. The caller's mode is put back, with the
// exception flags that it had.
#pragma once

#include <stdint.h>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace palpate {

class FlushDenormals {
 public:
#if defined(__SSE2__)
  FlushDenormals() : mode_(_mm_getcsr()) {
    _mm_setcsr(kDefault | kFlushResults | kFlushOperands);
  }
  ~FlushDenormals() {
    _mm_setcsr(mode_);
  }
#elif defined(__aarch64__)
  FlushDenormals() {
    __asm__ volatile("mrs %0, fpcr" : "=r"(mode_));
    __asm__ volatile("msr fpcr, %0" : : "r"(kFlush));
  }
  ~FlushDenormals() {
    __asm__ volatile("msr fpcr, %0" : : "r"(mode_));
  }
#endif
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

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
