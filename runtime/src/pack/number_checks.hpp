// Checks of arrays and numbers for every part of a pack: opening runs the checks once, so that frames need
// none.
#pragma once

#include <palpate/palpate.h>
#include <string.h>

#include "runtime/src/pack/pack_view.hpp"
#include "schemas/pack_generated.h"
#include "schemas/pack_layout.hpp"

namespace palpate {

// Bounds of a pack's numbers, far outside anything physical. Within these bounds no double overflows on the
// way to a force, and no float32 on the way to a displacement.
inline constexpr double kLargestScale = 1e15;   // limit of lengths and units; the smallest is 1 / this
inline constexpr double kLargestEnergy = 1e60;  // limit of energy coefficients
// Limit of the displacement of any node per displacement of the tool: a field coefficient over
// max_displacement, or an entry of a column of the field compliance over the column's diagonal entry.
inline constexpr double kLargestAmplification = 1e6;
// Limit of forces: max_displacement in m over the compliance of a contact node.
inline constexpr double kLargestPush = 1e20;
// Limit of the force at a patch node per displacement of the patch, relative to the force that moves the node
// alone as far.
inline constexpr double kLargestNodalForce = 1e8;
inline constexpr uint32_t kMostNodes = 1u << 26;  // products of counts stay below 2^64

// The bits without the sign. As integers, such bits sort as the numbers' sizes, with infinity and NaN last.
// The parameter is a reference: loading a float by value would quieten a signalling NaN.
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

// Whether no difference among those combined by | is negative: a negative difference sets the highest bit.
template <typename Bits>
bool none_below_zero(Bits differences) {
  return differences >> (8 * sizeof differences - 1) == 0;
}

// Whether |value| <= limit for all values; NaN fails. GCC vectorises the loop only outside its callers, so
// the function is not inlined.
template <typename Number>
[[gnu::noinline]] bool all_within(const Number* values, size_t count, Number limit) {
  const BitsOf<Number> most = bits_of_size(limit);
  BitsOf<Number> differences = 0;
  for (size_t i = 0; i < count; ++i) differences |= most - bits_of_size(values[i]);
  return none_below_zero(differences);
}

// Whether a value can be a length or a unit.
inline bool is_scale(double value) {
  return value >= 1 / kLargestScale && value <= kLargestScale;
}

// Whether a value can be the displacement of a contact node under its own unit force along an axis.
inline bool is_own_compliance(const pal_pack& pack, double value) {
  return value >= pack.max_displacement * pack.metres / kLargestPush && value <= kLargestPush;
}

// The bytes of a segment. nullptr if the segment is missing, misplaced, or not `count` elements long.
inline const unsigned char* segment_bytes(const pal_pack& pack, const pack::Segment* segment,
                                          uint64_t first_offset, uint64_t count, uint64_t element_bytes) {
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
