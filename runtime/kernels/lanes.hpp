// Four doubles side by side, one for each of four elements.
#pragma once

#include <cstddef>

namespace palpate {

constexpr int kLanes = 4;

// A compiler vector in a struct with a fixed alignment. The alignment of the bare vector type depends on the
// instruction set of the surrounding function. Inlining lets the arithmetic use that instruction set.
struct alignas(kLanes * sizeof(double)) Lanes {
  using Vector = double __attribute__((vector_size(kLanes * sizeof(double))));
  Vector values;

  double operator[](int lane) const { return values[lane]; }
  void set(int lane, double value) { values[lane] = value; }
  void add(int lane, double value) { values[lane] += value; }

#define PALPATE_LANES_OPERATOR(op)                                                         \
  [[gnu::always_inline]] friend inline Lanes operator op(const Lanes& a, const Lanes& b) { \
    return {a.values op b.values};                                                         \
  }                                                                                        \
  [[gnu::always_inline]] friend inline Lanes operator op(double a, const Lanes& b) {       \
    return {a op b.values};                                                                \
  }
  PALPATE_LANES_OPERATOR(+)
  PALPATE_LANES_OPERATOR(-)
  PALPATE_LANES_OPERATOR(*)
  PALPATE_LANES_OPERATOR(/)
#undef PALPATE_LANES_OPERATOR
  [[gnu::always_inline]] inline Lanes& operator+=(const Lanes& other) {
    values += other.values;
    return *this;
  }
  [[gnu::always_inline]] inline Lanes& operator*=(const Lanes& other) {
    values *= other.values;
    return *this;
  }
};

}  // namespace palpate
