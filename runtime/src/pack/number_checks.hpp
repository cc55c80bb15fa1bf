// What every reader of a part of a pack asks of its arrays and numbers, once, so that a frame need not.
#pragma once

#include <palpate/palpate.h>
#include <string.h>

#include "runtime/src/pack/pack_view.hpp"
#include "schemas/pack_generated.h"
#include "schemas/pack_layout.hpp"

namespace palpate {

// Bounds of what a pack may say, far outside anything physical. Within them no double overflows on the way to
// a force (the worst product is below 1e140) and no float32 on the way to a displacement (below 1e37).
inline constexpr double kLargestScale =
    1e15;  // of lengths, and of what a unit means; 1 / this is the smallest
inline constexpr double kLargestEnergy = 1e60;  // coefficient
// Displacement of any node per displacement of the tool: a field coefficient in units of max_displacement, a
// column of the field compliance in units of its diagonal.
inline constexpr double kLargestAmplification = 1e6;
inline constexpr double kLargestPush =
    1e20;  // max_displacement in m over the compliance of a contact node: a force
// Force at a node of a patch per displacement of the patch, in units of what moves the node alone so far.
inline constexpr double kLargestNodalForce = 1e8;
inline constexpr uint32_t kMostNodes = 1u << 26;  // products of counts then stay below 2^64

// Without its sign bit a number has the order of the integer of the same bits, infinity and the NaNs behind
// the largest number. By reference: a load as a number would quieten a signalling NaN.
inline uint32_t bits_of_size(const float& value) {
  uint32_t bits;
  memcpy(&bits, &value, sizeof bits);
  return bits & (UINT32_MAX >> 1);
}

inline uint64_t bits_of_size(const double& value) {
  uint64_t bits;
  memcpy(&bits, &value, sizeof bits);
  return bits & (UINT64_MAX >> 1);
}

template <typename Number>
using BitsOf = decltype(bits_of_size(Number{}));

// Of differences of such, taken together by |: below 0 the highest bit is set.
template <typename Bits>
bool none_below_zero(Bits differences) {
  return differences >> (8 * sizeof differences - 1) == 0;
}

// |value| <= limit for all, which no NaN is; limit >= 0. Not inlined: in the midst of its callers GCC does not
// vectorise the loop.
template <typename Number>
[[gnu::noinline]] bool all_within(const Number* values, size_t count, Number limit) {
  const BitsOf<Number> most = bits_of_size(limit);
  BitsOf<Number> differences = 0;
  for (size_t i = 0; i < count; ++i) differences |= most - bits_of_size(values[i]);
  return none_below_zero(differences);
}

// A length, or what a unit means.
inline bool is_scale(double value) {
  return value >= 1 / kLargestScale && value <= kLargestScale;
}

// Displacement of a contact node by a unit force on it, along an axis.
inline bool is_own_compliance(const pal_pack& pack, double value) {
  return value >= pack.max_displacement * pack.metres / kLargestPush && value <= kLargestPush;
}

// The bytes of a segment, or nullptr if it is missing, misplaced or not `count` elements long. Not inlined: opening a
// pack asks for some thirty.
[[gnu::noinline]] inline const unsigned char* segment_bytes(const pal_pack& pack,
                                                            const pack::Segment* segment,
                                                            uint64_t first_offset, uint64_t count,
                                                            uint64_t element_bytes) {
  if (segment == nullptr || segment->offset() % pack::kAlignment != 0 || segment->offset() < first_offset ||
      segment->offset() > pack.num_bytes || segment->bytes() > pack.num_bytes - segment->offset() ||
      segment->bytes() % element_bytes != 0 || segment->bytes() / element_bytes != count) {
    return nullptr;
  }
  return pack.bytes + segment->offset();
}

template <typename T>
const T* array_of(const pal_pack& pack, const pack::Segment* segment, uint64_t first_offset, uint64_t count) {
  return reinterpret_cast<const T*>(segment_bytes(pack, segment, first_offset, count, sizeof(T)));
}

}  // namespace palpate
