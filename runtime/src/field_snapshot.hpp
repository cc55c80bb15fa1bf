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

#include "runtime/src/polynomial_dd.hpp"

namespace palpate {

// Of contact or zone nodes.
struct NodalForces {
  uint32_t count;
  const uint32_t* nodes;
  const pal_real* weights;  // [count][3]
};

// The field of one haptic frame, as weights of columns in the pack. API units.
struct FieldState {
  pal_model model;  // that answered; PAL_MODEL_AUTO: the tissue is at rest
  uint32_t
      num_corners;  // polynomial_dd, and where nonlinear_zone is moved by it: sites whose fields are added
  PolynomialFieldState* corners;  // [num_corners]
  uint32_t num_held;              // linear_dd, nonlinear_zone: contact or zone nodes with a force,
  uint32_t num_moved;             // and behind them nodes whose forces move nonlinear_zone itself too
  uint32_t* held;                 // [num_held + num_moved]
  pal_real* weights;              // and their forces [num_held + num_moved][3]
  uint32_t num_own;               // nonlinear_zone: packed nodes in it, which move otherwise
  uint32_t* own_nodes;
  pal_real* own;          // [num_own][3] displacements from the mesh
  uint32_t num_exterior;  // nonlinear_zone: contacts whose exterior fields take part
  uint32_t exterior_rings;
  uint32_t* exterior_sites;
  pal_real* exterior_weights;  // of their columns (zone_exterior.hpp)
  bool gravity_turned;
  pal_real gravity_turn[3];

  NodalForces forces() const { return {num_held, held, weights}; }
  NodalForces moving_forces() const { return {num_moved, held + num_held, weights + size_t{3} * num_held}; }
};

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
