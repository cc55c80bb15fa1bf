// Normals of the displaced surface for drawing. The normal of a node is the normalised sum of its triangles'
// normals, weighted by area: Gouraud 1971. So large triangles count more, and slivers hardly count.
#include <math.h>
#include <string.h>

#include <palpate/palpate.h>

#include "runtime/src/base/floating_point_mode.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

// Three numbers in the caller's memory, which may start at any byte.
struct Strided {
  char* base;
  size_t stride;
  void load(uint32_t node, pal_real v[3]) const { memcpy(v, base + node * stride, 3 * sizeof(pal_real)); }
  void store(uint32_t node, const pal_real v[3]) const {
    memcpy(base + node * stride, v, 3 * sizeof(pal_real));
  }
};

// The edge between two corners. The difference at rest is in double, so that no digits are lost far from the
// origin.
void edge(const pal_pack& pack, const Strided& displacements, uint32_t from, uint32_t to, pal_real out[3]) {
  pal_real begin[3];
  pal_real end[3];
  displacements.load(from, begin);
  displacements.load(to, end);
  for (int i = 0; i < 3; ++i) {
    const double rest =
        pack.positions[size_t{3} * to + size_t(i)] - pack.positions[size_t{3} * from + size_t(i)];
    out[i] = static_cast<pal_real>(rest * pack.metres) + (end[i] - begin[i]);
  }
}

}  // namespace
}  // namespace palpate

extern "C" pal_status pal_pack_compute_normals(const pal_pack* pack, const pal_real* displacements,
                                               size_t displacement_stride, pal_real* normals,
                                               size_t normal_stride) noexcept {
  using palpate::Strided;
  if (pack == nullptr || displacements == nullptr || normals == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (displacement_stride < 3 * sizeof(pal_real) || normal_stride < 3 * sizeof(pal_real))
    return PAL_STATUS_BAD_ARGUMENT;
  const palpate::FloatingPointMode mode;
  const Strided from = {const_cast<char*>(reinterpret_cast<const char*>(displacements)), displacement_stride};
  const Strided to = {reinterpret_cast<char*>(normals), normal_stride};
  constexpr pal_real kZero[3] = {};
  for (uint32_t node = 0; node < pack->num_nodes; ++node) to.store(node, kZero);
  // Edges are relative to the mean edge, so that their products neither overflow nor underflow.
  const pal_real scale = static_cast<pal_real>(1.0 / (pack->mean_surface_edge * pack->metres));
  for (uint32_t t = 0; t < pack->num_triangles; ++t) {
    const uint32_t* corner = pack->triangles + size_t{3} * t;
    pal_real a[3];
    pal_real b[3];
    palpate::edge(*pack, from, corner[0], corner[1], a);
    palpate::edge(*pack, from, corner[0], corner[2], b);
    for (int i = 0; i < 3; ++i) {
      a[i] *= scale;
      b[i] *= scale;
    }
    const pal_real n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    for (int k = 0; k < 3; ++k) {
      pal_real sum[3];
      to.load(corner[k], sum);
      for (int i = 0; i < 3; ++i) sum[i] += n[i];
      to.store(corner[k], sum);
    }
  }
  for (uint32_t node = 0; node < pack->num_nodes; ++node) {
    pal_real n[3];
    to.load(node, n);
    const pal_real length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    const bool is_direction = length > 0 && isfinite(length);
    for (pal_real& component : n) component = is_direction ? component / length : pal_real{0};
    to.store(node, n);
  }
  return PAL_STATUS_OK;
}
