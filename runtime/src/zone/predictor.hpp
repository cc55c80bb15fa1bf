// What the exterior will add to the force on a zone's boundary before its next iteration has seen the contacts move.
//
// Between iterations a frame knows g (exterior.hpp) of the contacts' displacements d_e at the last iteration, and S. The
// force that remains is of second order in d. With the organ's linear modes phi_i, the displacements of all nodes
// for unit d_i at rest, and the even part of the forces outside along them,
//
//   g(d) = g_e + Q(d) - Q(d_e),   Q(d) = sum_{i >= j} q_ij d_i d_j
//   q_ii = r2(phi_i),   q_ij = r2(phi_i + phi_j) - r2(phi_i) - r2(phi_j)
//   r2(v) = (r(h v) + r(-h v)) / (2 h^2), condensed onto the boundary
//
// an answer is wrong to third order in d - d_e instead of second. A pack holds nothing of it: the refining lane
// makes the columns once for a contact set.
#pragma once

#include "runtime/src/zone/exterior.hpp"

namespace palpate {

inline constexpr uint32_t kMostPredictedAxes = 9;  // three contacts; q_ij grow with the square

struct Predictor {
  uint32_t num_axes;  // 3 for each contact
  uint32_t num_rows;  // 3 num_kept
  bool is_ready;
  double* modes;    // [num_axes][num_nodes][3] phi
  double* columns;  // [lower_block(num_axes, 0)][num_rows] q_ij, i >= j, by lower_block()
  // The column under way
  double step;      // h: 1, in units of d
  uint32_t column;  // modes to extend, then columns: q_ii first
  uint32_t sign;    // 0: +h, 1: -h, 2: their sum is condensed
  uint32_t front;   // fronts that this part has passed
};

void carve_predictor(const pal_pack& pack, uint32_t max_axes, uint32_t max_kept, Arena& arena,
                     Predictor& predictor);

// Begins with Predictor::modes on kept and absent nodes: the zone's linear response at rest to unit displacements of its
// contacts. `step`: h, some tenths of a mean edge.
void begin_predictor(const Condensation& condensation, uint32_t num_axes, double step, Predictor& predictor);

// Advances by about so many multiply-adds. No iteration may be under way: `state` lends its scratch. Fails where h
// inverts an element.
Progress advance_predictor(const Exterior& exterior, const Condensation& condensation, uint64_t operations,
                           CondensationScratch& scratch, ExteriorState& state, Predictor& predictor,
                           uint64_t& spent);

// force += factor Q(d); [num_rows]. d: [num_axes].
void add_prediction(const Predictor& predictor, const double* d, double factor, double* force);

}  // namespace palpate
