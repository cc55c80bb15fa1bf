#include "runtime/src/linear/contact_stiffness.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/pack/compliance.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

// The compliance keeps 16 digits less the digits of cond(K). A pivot of S below this fraction of the node's
// own compliance is rounding: the node moves with the other nodes.
constexpr double kSmallestPivot = 1e-11;
// Springs, as fractions of the node's mean compliance, tried in this order until S is positive definite. A
// spring changes well-conditioned forces by about its fraction. If all fail, the node acts as if alone.
constexpr double kSprings[] = {0.0, 1e-9, 1e-5, 1e-1};
// Largest accepted entry of |M A_k - E_k|. Rounding times the condition of A stays far below this limit.
constexpr double kLargestError = 1e-7;

// Inverts the Cholesky factor of S: S^-1 = R^T R, R by rows. Returns false if a pivot is not above `least`.
bool factor_inverse(const double symmetric[9], const double least[3], double lower[9]) {
  const double p0 = symmetric[0];
  if (!(p0 > least[0])) return false;
  const double l00 = sqrt(p0);
  const double l10 = symmetric[3] / l00;
  const double l20 = symmetric[6] / l00;
  const double p1 = symmetric[4] - l10 * l10;
  if (!(p1 > least[1])) return false;
  const double l11 = sqrt(p1);
  const double l21 = (symmetric[7] - l20 * l10) / l11;
  const double p2 = symmetric[8] - l20 * l20 - l21 * l21;
  if (!(p2 > least[2]) || !isfinite(p2)) return false;
  const double l22 = sqrt(p2);
  lower[0] = 1.0 / l00;
  lower[4] = 1.0 / l11;
  lower[8] = 1.0 / l22;
  lower[3] = -l10 * lower[0] / l11;
  lower[6] = -(l20 * lower[0] + l21 * lower[3]) / l22;
  lower[7] = -l21 * lower[4] / l22;
  lower[1] = lower[2] = lower[5] = 0;
  return true;
}

// C := C R^T: columns[r][i] := sum over s <= r of lower[r][s] columns[s][i].
void apply_factor(const double lower[9], uint32_t n, size_t stride, double* columns) {
  double* c0 = columns;
  double* c1 = columns + stride;
  double* c2 = columns + 2 * stride;
  for (uint32_t i = 0; i < n; ++i) {
    const double x = c0[i];
    const double y = c1[i];
    const double z = c2[i];
    c0[i] = lower[0] * x;
    c1[i] = lower[3] * x + lower[4] * y;
    c2[i] = lower[6] * x + lower[7] * y + lower[8] * z;
  }
}

// dots[r][s] = sum over i < n of p[r][i] q[s][i].
void dot_columns(const double* p, const double* q, uint32_t n, size_t stride, double dots[9]) {
  for (uint32_t r = 0; r < 3; ++r) {
    for (uint32_t s = 0; s < 3; ++s) {
      double sum = 0;
      for (uint32_t i = 0; i < n; ++i) sum += p[r * stride + i] * q[s * stride + i];
      dots[3 * r + s] = sum;
    }
  }
}

// Fills `columns` with the compliance of the held nodes under forces at a node.
void gather_columns(const pal_pack& pack, uint32_t node, const ContactStiffness& inverse) {
  double block[9];
  for (uint32_t slot = 0; slot < inverse.num_nodes; ++slot) {
    contact_compliance(pack, inverse.nodes[slot], node, block);
    for (uint32_t row = 0; row < 3; ++row) {
      for (uint32_t r = 0; r < 3; ++r)
        inverse.columns[r * inverse.stride + 3 * slot + row] = block[3 * row + r];
    }
  }
}

// Computes R for S with the softest spring that makes S positive definite. Returns false if all springs fail.
bool factor_schur(const double own[9], const double schur[9], double lower[9], bool& regularised) {
  const double mean = (own[0] + own[4] + own[8]) / 3.0;
  for (const double spring : kSprings) {
    double with_spring[9];
    memcpy(with_spring, schur, sizeof with_spring);
    double least[3];
    for (uint32_t i = 0; i < 3; ++i) {
      with_spring[4 * i] += spring * mean;
      least[i] = kSmallestPivot * (own[4 * i] + spring * mean);
    }
    regularised = spring > 0;
    if (factor_inverse(with_spring, least, lower)) return true;
  }
  return false;
}

}  // namespace

void carve_inverse(const pal_pack& pack, uint32_t max_nodes, Arena& arena, ContactStiffness& inverse) {
  inverse.max_nodes = max_nodes;
  const size_t dofs = size_t{3} * max_nodes;
  inverse.stride = inverse_stride(max_nodes);
  inverse.nodes = arena.take<uint32_t>(max_nodes);
  inverse.slot_of = arena.take<uint32_t>(pack.num_contact_nodes);
  inverse.regularised = arena.take<bool>(max_nodes);
  inverse.matrix = arena.take<double>(dofs * inverse.stride);
  inverse.columns = arena.take<double>(3 * inverse.stride);
  inverse.products = arena.take<double>(3 * inverse.stride);
  inverse.negated = arena.take<double>(3 * inverse.stride);
}

void add_node(const pal_pack& pack, uint32_t node, ContactStiffness& inverse) {
  const uint32_t slot = inverse.num_nodes;
  const uint32_t n = 3 * slot;
  const size_t stride = inverse.stride;
  double own[9];
  contact_compliance(pack, node, node, own);
  gather_columns(pack, node, inverse);
  inverse.kernel.multiply(inverse.matrix, stride, slot, inverse.columns, inverse.products);
  double schur[9];
  dot_columns(inverse.columns, inverse.products, n, stride, schur);
  for (uint32_t i = 0; i < 9; ++i) schur[i] = own[i] - schur[i];

  double lower[9];
  bool regularised = false;
  if (!factor_schur(own, schur, lower, regularised)) {
    regularised = true;
    memset(inverse.products, 0, 3 * stride * sizeof *inverse.products);
    const double positive[3] = {0, 0, 0};
    const double diagonal[9] = {own[0], 0, 0, 0, own[4], 0, 0, 0, own[8]};
    if (!factor_inverse(diagonal, positive, lower)) memset(lower, 0, sizeof lower);
  }
  // S^-1 W^T = R^T (R W^T): with P = W R^T, the new rows are -R^T P^T.
  apply_factor(lower, n, stride, inverse.products);
  inverse.kernel.add_products(inverse.matrix, stride, slot, inverse.products, inverse.products);
  double* rows = inverse.matrix + n * stride;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    for (uint32_t i = 0; i < n; ++i) {
      double sum = 0;
      for (uint32_t r = axis; r < 3; ++r) sum -= lower[3 * r + axis] * inverse.products[r * stride + i];
      rows[axis * stride + i] = sum;
      inverse.matrix[i * stride + n + axis] = sum;
    }
    for (uint32_t other = 0; other < 3; ++other) {
      double sum = 0;
      for (uint32_t r = 0; r < 3; ++r) sum += lower[3 * r + axis] * lower[3 * r + other];
      rows[axis * stride + n + other] = sum;
    }
  }
  inverse.nodes[slot] = node;
  inverse.slot_of[node] = slot + 1;
  inverse.regularised[slot] = regularised;
  inverse.num_regularised += regularised ? 1 : 0;
  ++inverse.num_nodes;
  ++inverse.changes;
}

bool remove_node(uint32_t slot, ContactStiffness& inverse) {
  const size_t stride = inverse.stride;
  const uint32_t last = inverse.num_nodes - 1;
  const uint32_t n = 3 * inverse.num_nodes;
  const double* rows = inverse_row(inverse, slot, 0);
  double own[9];
  for (uint32_t i = 0; i < 9; ++i) own[i] = rows[(i / 3) * stride + 3 * slot + i % 3];
  double lower[9];
  const double positive[3] = {0, 0, 0};
  if (!factor_inverse(own, positive, lower)) {
    remove_all_nodes(inverse);
    return false;
  }
  for (uint32_t r = 0; r < 3; ++r) memcpy(inverse.products + r * stride, rows + r * stride, n * sizeof *rows);
  apply_factor(lower, n, stride, inverse.products);
  for (size_t r = 0; r < 3; ++r) {
    for (uint32_t i = 0; i < n; ++i) inverse.negated[r * stride + i] = -inverse.products[r * stride + i];
  }
  inverse.kernel.add_products(inverse.matrix, stride, inverse.num_nodes, inverse.negated, inverse.products);

  inverse.slot_of[inverse.nodes[slot]] = 0;
  inverse.num_regularised -= inverse.regularised[slot] ? 1 : 0;
  if (slot != last) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      memcpy(inverse.matrix + (3 * slot + axis) * stride, inverse.matrix + (3 * last + axis) * stride,
             n * sizeof *rows);
    }
    for (uint32_t i = 0; i < 3 * last; ++i) {
      double* row = inverse.matrix + i * stride;
      for (uint32_t axis = 0; axis < 3; ++axis) row[3 * slot + axis] = row[3 * last + axis];
    }
    inverse.nodes[slot] = inverse.nodes[last];
    inverse.slot_of[inverse.nodes[slot]] = slot + 1;
    inverse.regularised[slot] = inverse.regularised[last];
  }
  inverse.num_nodes = last;
  ++inverse.changes;
  return true;
}

void remove_all_nodes(ContactStiffness& inverse) {
  for (uint32_t slot = 0; slot < inverse.num_nodes; ++slot) inverse.slot_of[inverse.nodes[slot]] = 0;
  inverse.num_nodes = 0;
  inverse.num_regularised = 0;
  inverse.changes = 0;
}

bool correct_inverse(const pal_pack& pack, ContactStiffness& inverse) {
  if (!is_correction_due(inverse)) return true;
  inverse.changes = 0;
  const uint32_t slot = inverse.next_corrected++ % inverse.num_nodes;
  const uint32_t n = 3 * inverse.num_nodes;
  const size_t stride = inverse.stride;
  double* residual = inverse.products;  // Y, then P, then V
  gather_columns(pack, inverse.nodes[slot], inverse);
  inverse.kernel.multiply(inverse.matrix, stride, inverse.num_nodes, inverse.columns, residual);
  double error = 0;
  for (uint32_t r = 0; r < 3; ++r) {
    residual[r * stride + 3 * slot + r] -= 1.0;
    for (uint32_t i = 0; i < n; ++i) {
      const double size = fabs(residual[r * stride + i]);
      if (!(size <= kLargestError)) return false;
      if (size > error) error = size;
    }
  }
  if (error == 0) return true;
  double projection[9];  // A_k^T Y
  dot_columns(inverse.columns, residual, n, stride, projection);
  double largest = 0;
  for (uint32_t r = 0; r < 3; ++r) {
    const double* row = inverse_row(inverse, slot, r);
    for (uint32_t i = 0; i < n; ++i) {
      for (uint32_t s = 0; s < 3; ++s)
        residual[s * stride + i] -= 0.25 * (projection[3 * r + s] + projection[3 * s + r]) * row[i];
      largest = fabs(row[i]) > largest ? fabs(row[i]) : largest;
    }
  }
  // P W^T + W P^T = U U^T - V V^T, U, V = (c P +- W / c) / sqrt(2). The factor c gives both terms one size.
  const double p_scale = sqrt(0.5 * largest / error);
  const double w_scale = 0.5 / p_scale;
  for (uint32_t r = 0; r < 3; ++r) {
    const double* row = inverse_row(inverse, slot, r);
    for (uint32_t i = 0; i < n; ++i) {
      const size_t at = r * stride + i;
      const double p = p_scale * residual[at];
      const double w = w_scale * row[i];
      inverse.columns[at] = p + w;
      inverse.negated[at] = -(p + w);
      residual[at] = p - w;
    }
  }
  inverse.kernel.add_products(inverse.matrix, stride, inverse.num_nodes, inverse.negated, inverse.columns);
  inverse.kernel.add_products(inverse.matrix, stride, inverse.num_nodes, residual, residual);
  return true;
}

}  // namespace palpate
