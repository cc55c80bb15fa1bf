#include "runtime/src/zone/predictor.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {
namespace {

double* mode(const Exterior& exterior, const Predictor& predictor, uint32_t axis) {
  return predictor.modes + size_t{3} * exterior.pack.organ.num_nodes * axis;
}

double* column(const Predictor& predictor, uint32_t i, uint32_t j) {
  return predictor.columns + pack::lower_block(i, j) * predictor.num_rows;
}

// rest + h v, for the column's sign; the forces start at zero with the first sign.
void begin_sign(const Exterior& exterior, uint32_t i, uint32_t j, ExteriorState& state,
                Predictor& predictor) {
  const OrganView& organ = exterior.pack.organ;
  const double h = predictor.sign == 0 ? predictor.step : -predictor.step;
  const double* one = mode(exterior, predictor, i);
  const double* other = mode(exterior, predictor, j);
  for (uint32_t node = 0; node < organ.num_nodes; ++node) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const size_t at = size_t{3} * node + axis;
      const double v = i == j ? one[at] : one[at] + other[at];
      state.next[at] = organ.nodes[node].displacement[axis] + h * v;
      state.next_forces[at] = (predictor.sign == 0 ? 0.0 : state.next_forces[at]) - state.rest_force[at];
    }
  }
  state.strain = {0, static_cast<double>(INFINITY)};
}

void clear_fixed_axes(const OrganView& organ, double* forces) {
  for (uint32_t node = 0; node < organ.num_nodes; ++node) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      if ((organ.nodes[node].free_axes >> axis & 1) == 0) forces[size_t{3} * node + axis] = 0;
    }
  }
}

// q_ij of the condensed r(h v) + r(-h v).
void take_column(const Condensation& condensation, const double* forces, uint32_t i, uint32_t j,
                 Predictor& predictor) {
  double* to = column(predictor, i, j);
  const double scale = 0.5 / (predictor.step * predictor.step);
  for (uint32_t row = 0; row < predictor.num_rows; ++row) {
    to[row] = scale * forces[size_t{3} * condensation.kept[row / 3] + row % 3];
    if (i != j) to[row] -= column(predictor, i, i)[row] + column(predictor, j, j)[row];
  }
}

// Columns in this order: q_ii of all axes, then q_ij, i > j.
void find_pair(const Predictor& predictor, uint32_t index, uint32_t& i, uint32_t& j) {
  i = j = index;
  if (index < predictor.num_axes) return;
  pack::find_lower_block(index - predictor.num_axes, i, j);
  ++i;
}

}  // namespace

void carve_predictor(const pal_pack& pack, uint32_t max_axes, uint32_t max_kept, Arena& arena,
                     Predictor& predictor) {
  predictor = {};
  predictor.modes = arena.take<double>(size_t{3} * pack.organ.num_nodes * max_axes);
  predictor.columns = arena.take<double>(pack::lower_block(max_axes, 0) * 3 * max_kept);
}

void begin_predictor(const Condensation& condensation, uint32_t num_axes, double step, Predictor& predictor) {
  predictor.num_axes = num_axes;
  predictor.num_rows = 3 * condensation.num_kept;
  predictor.is_ready = false;
  predictor.step = step;
  predictor.column = predictor.sign = predictor.front = 0;
}

Progress advance_predictor(const Exterior& exterior, const Condensation& condensation, uint64_t operations,
                           CondensationScratch& scratch, ExteriorState& state, Predictor& predictor,
                           uint64_t& spent) {
  const OrganView& organ = exterior.pack.organ;
  const auto num_columns = static_cast<uint32_t>(pack::lower_block(predictor.num_axes, 0));
  while (predictor.column < predictor.num_axes + num_columns) {
    if (spent >= operations) return Progress::goes_on;
    if (predictor.column < predictor.num_axes) {  // an extension
      double* values = mode(exterior, predictor, predictor.column);
      for (uint32_t node = 0; node < organ.num_nodes && predictor.front == 0; ++node) {
        if (condensation.roles[node] == NodeRole::eliminated)
          memset(values + size_t{3} * node, 0, 3 * sizeof *values);
      }
      spent += backward_substitute_front(condensation, exterior.kernel,
                                         organ.num_fronts - 1 - predictor.front, scratch, values);
      if (++predictor.front == organ.num_fronts) {
        predictor.front = 0;
        ++predictor.column;
      }
      continue;
    }
    uint32_t i;
    uint32_t j;
    find_pair(predictor, predictor.column - predictor.num_axes, i, j);
    // Two evaluations, then the forward substitution of their sum
    const uint32_t front = predictor.front++;
    if (predictor.sign < 2) {
      if (front == 0) begin_sign(exterior, i, j, state, predictor);
      spent += evaluate_front(exterior, front, state.next, state.strain, state.next_forces);
      if (predictor.front == organ.num_fronts && !(state.strain.smallest_jacobian > kLeastJacobian))
        return Progress::failed;
    } else {
      if (front == 0) clear_fixed_axes(organ, state.next_forces);
      spent += forward_substitute_front(condensation, exterior.kernel, front, scratch, state.next_forces);
    }
    if (predictor.front < organ.num_fronts) continue;
    predictor.front = 0;
    if (++predictor.sign < 3) continue;
    take_column(condensation, state.next_forces, i, j, predictor);
    predictor.sign = 0;
    ++predictor.column;
  }
  predictor.is_ready = true;
  return Progress::ended;
}

void add_prediction(const Predictor& predictor, const double* d, double factor, double* force) {
  for (uint32_t i = 0; i < predictor.num_axes; ++i) {
    for (uint32_t j = 0; j <= i; ++j) {
      const double weight = factor * d[i] * d[j];
      const double* of = column(predictor, i, j);
      for (uint32_t row = 0; row < predictor.num_rows; ++row) force[row] += weight * of[row];
    }
  }
}

}  // namespace palpate
