// What a visual frame needs of a haptic frame, handed from the thread of the one to the thread of the other;
// neither ever waits, and neither sees the other at work.
//
//   haptic thread              between them                visual thread
//   fills slot `back`  --->  `shared`: a slot, fresh?  --->  reads slot `front`
//
// Three slots, each held by one of the three places. publish() swaps `back` with the shared one and marks it
// fresh; acquire() swaps `front` with it if it is fresh. A slot is thus never written while it is read, an
// unread slot is overwritten by a newer one, and a reader finds the newest finished frame. One writer, one
// reader: the swaps are wait-free. (Known as triple buffering.)
#pragma once

#include <palpate/palpate.h>

#include <atomic>

#include "runtime/src/zone/field_state.hpp"

namespace palpate {

struct FieldSnapshots {
  FieldState slots[3];
  uint32_t back;   // the writer's
  uint32_t front;  // the reader's
  alignas(64) uint32_t shared;
};

inline constexpr uint32_t kFreshSlot = 4;
inline constexpr uint32_t kSlotIndex = 3;

inline void reset_snapshots(FieldSnapshots& snapshots) {
  snapshots.back = 0;
  snapshots.shared = 1;
  snapshots.front = 2;
}

// By the writer, once slots[back] is filled.
inline void publish(FieldSnapshots& snapshots) {
  const std::atomic_ref<uint32_t> shared(snapshots.shared);
  snapshots.back = shared.exchange(snapshots.back | kFreshSlot, std::memory_order_acq_rel) & kSlotIndex;
}

// By the reader: the newest published frame.
inline const FieldState& acquire(FieldSnapshots& snapshots) {
  const std::atomic_ref<uint32_t> shared(snapshots.shared);
  if ((shared.load(std::memory_order_relaxed) & kFreshSlot) != 0)
    snapshots.front = shared.exchange(snapshots.front, std::memory_order_acq_rel) & kSlotIndex;
  return snapshots.slots[snapshots.front];
}

}  // namespace palpate
