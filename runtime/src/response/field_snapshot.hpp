// Triple buffering: hands the field of a haptic frame to the visual thread. Neither thread waits.
//
//   haptic thread              between them                visual thread
//   fills slot `back`  --->  `shared`: a slot, fresh?  --->  reads slot `front`
//
// Each of three slots has one of the three places. publish() swaps `back` with the shared slot and marks the
// shared slot fresh. acquire() swaps `front` with the shared slot if that slot is fresh. Hence:
// - No slot is written while the other thread reads the slot.
// - A newer slot replaces an unread slot.
// - The reader gets the newest finished frame.
//
// With one writer and one reader the swaps are wait-free.
#pragma once

#include <palpate/palpate.h>

#include <atomic>

#include "runtime/src/zone/field_state.hpp"

namespace palpate {

struct FieldSnapshots {
  FieldState slots[3];
  uint32_t back;                // index of the writer's slot
  uint32_t front;               // index of the reader's slot
  alignas(64) uint32_t shared;  // index of the shared slot, plus kFreshSlot if it is fresh; atomic
};

inline constexpr uint32_t kFreshSlot = 4;
inline constexpr uint32_t kSlotIndex = 3;

inline void reset_snapshots(FieldSnapshots& snapshots) {
  snapshots.back = 0;
  snapshots.shared = 1;
  snapshots.front = 2;
}

// One bit for each field of the refining lane (ZoneMailbox::fields) that a slot uses.
inline uint32_t used_fields(const FieldSnapshots& snapshots) {
  uint32_t used = 0;
  for (const FieldState& slot : snapshots.slots) {
    if (slot.response != kNoField) used |= 1u << slot.response;  // refined_field: the same or none
  }
  return used;
}

// The writer calls publish() once slots[back] is filled.
inline void publish(FieldSnapshots& snapshots) {
  const std::atomic_ref<uint32_t> shared(snapshots.shared);
  snapshots.back = shared.exchange(snapshots.back | kFreshSlot, std::memory_order_acq_rel) & kSlotIndex;
}

// The reader gets the newest published frame.
inline const FieldState& acquire(FieldSnapshots& snapshots) {
  const std::atomic_ref<uint32_t> shared(snapshots.shared);
  if ((shared.load(std::memory_order_relaxed) & kFreshSlot) != 0)
    snapshots.front = shared.exchange(snapshots.front, std::memory_order_acq_rel) & kSlotIndex;
  return snapshots.slots[snapshots.front];
}

}  // namespace palpate
