#include "runtime/src/linear/linear_point.hpp"

namespace palpate {
namespace {

// Iterates over the nodes of a few patches in ascending order, each node once.
class PatchUnion {
 public:
  PatchUnion(const pal_pack& pack, const ContactPlace& place) : pack_(pack), place_(place) {
    for (uint32_t i = 0; i < place.count; ++i) at_[i] = pack.patch_starts[place.corners[i].site];
  }

  // Finds the next node. Returns false at the end.
  bool find_next(uint32_t& node) const {
    node = UINT32_MAX;
    for (uint32_t i = 0; i < place_.count; ++i) {
      if (has_next(i) && pack_.patch_nodes[at_[i]] < node) node = pack_.patch_nodes[at_[i]];
    }
    return node != UINT32_MAX;
  }

  // Advances past the next node. Calls add(corner, entry of patch_nodes) for each patch that holds the node.
  template <typename Add>
  void take(uint32_t node, Add&& add) {
    for (uint32_t i = 0; i < place_.count; ++i) {
      if (has_next(i) && pack_.patch_nodes[at_[i]] == node) add(i, at_[i]++);
    }
  }

 private:
  bool has_next(uint32_t i) const { return at_[i] < pack_.patch_starts[place_.corners[i].site + 1]; }
  const pal_pack& pack_;
  const ContactPlace& place_;
  uint32_t at_[kMostCorners] = {};
};

}  // namespace

uint32_t evaluate_linear_point(const pal_pack& pack, const ContactPlace& place, const double d[3],
                               LinearPointAnswer& answer, uint32_t* held, pal_real* forces) {
  answer = {};
  uint32_t num_held = 0;
  PatchUnion nodes(pack, place);
  for (uint32_t node; nodes.find_next(node);) {
    double sum[9] = {};
    nodes.take(node, [&](uint32_t corner, uint32_t entry) {
      const double* X = pack.site_forces + size_t{9} * entry;
      for (int i = 0; i < 9; ++i) sum[i] += place.corners[corner].weight * X[i];
    });
    for (int i = 0; i < 9; ++i) answer.stiffness[i] += sum[i];
    if (held == nullptr) continue;
    held[num_held] = node;
    pal_real* nodal_force = forces + size_t{3} * num_held++;
    for (int i = 0; i < 3; ++i) {
      const double force = sum[3 * i] * d[0] + sum[3 * i + 1] * d[1] + sum[3 * i + 2] * d[2];
      nodal_force[i] = static_cast<pal_real>(force * pack.metres);
    }
  }
  double* S = answer.stiffness;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < i; ++j) S[3 * i + j] = S[3 * j + i] = 0.5 * (S[3 * i + j] + S[3 * j + i]);
  }
  for (int i = 0; i < 3; ++i) answer.force[i] = S[3 * i] * d[0] + S[3 * i + 1] * d[1] + S[3 * i + 2] * d[2];
  answer.energy = 0.5 * (answer.force[0] * d[0] + answer.force[1] * d[1] + answer.force[2] * d[2]);
  return num_held;
}

double patch_stiffness_norm(const pal_pack& pack, uint32_t site) {
  double stiffness[9] = {};
  for (uint32_t p = pack.patch_starts[site]; p < pack.patch_starts[site + 1]; ++p) {
    for (uint32_t i = 0; i < 9; ++i) stiffness[i] += pack.site_forces[size_t{9} * p + i];
  }
  double square = 0;
  for (const double entry : stiffness) square += entry * entry;
  return sqrt(square);
}

}  // namespace palpate
