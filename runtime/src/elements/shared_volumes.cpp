#include "runtime/src/elements/shared_volumes.hpp"

#include "runtime/src/elements/element_laws.hpp"

namespace palpate {
namespace {

void add_measures_of(const ZoneLanes& batch, const Lanes& volume, const KinematicsLanes& kinematics,
                     ZonePatch* patches) {
  for (int lane = 0; lane < batch.count; ++lane) {
    if (batch.patches[lane] == pack::kNoPatch) continue;
    patches[batch.patches[lane]].measure +=
        volume[lane] * volume_measure(*batch.materials[lane], kinematics.I1[lane], kinematics.J[lane]);
  }
}

template <int kNodes>
void add_measures(const ZoneBatch<kNodes>* batches, uint32_t count, const double* displacement,
                  ZonePatch* patches) {
  for (uint32_t n = 0; n < count; ++n) {
    const ZoneBatch<kNodes>& batch = batches[n];
    const NodalLanes<kNodes> nodal = gather(batch.elements, displacement);
    for (const auto& point : batch.elements.points) {
      KinematicsLanes kinematics;
      batch_kernels<kNodes>().deform(point, nodal, kinematics);
      add_measures_of(batch, point.volume, kinematics, patches);
    }
  }
}

// Whether `kept` leaves out a patch. A patch is left out as a whole, so its first element decides.
template <int kNodes>
bool leaves_out(const ZoneBatch<kNodes>* batches, uint32_t count, const ZoneBatches::Kept& kept,
                uint32_t patch) {
  for (uint32_t n = 0; n < count && kept.of_lane != nullptr; ++n) {
    for (int lane = 0; lane < batches[n].count; ++lane) {
      if (batches[n].patches[lane] == patch) return !kept.holds(n, lane);
    }
  }
  return false;
}

bool is_left_out(const ZoneBatches& batches, uint32_t patch) {
  return leaves_out(batches.linear, batches.num_linear, batches.kept_linear, patch) ||
         leaves_out(batches.quadratic, batches.num_quadratic, batches.kept_quadratic, patch);
}

// G = d(V theta) of a patch by the unknowns that move its nodes.
struct PatchGradient {
  // An entry for each node, and two for each contact: displacements and spins
  static constexpr uint32_t kMost = pack::kMostPatchNodes + 2 * pack::kMostZoneContacts;
  uint32_t count = 0;
  uint32_t first[kMost];  // first of three unknowns
  double values[kMost][3];

  void add(uint32_t unknown, double share, const double value[3]) {
    uint32_t i = 0;
    while (i < count && first[i] != unknown) ++i;
    if (i == count) {
      first[count++] = unknown;
      for (double& component : values[i]) component = 0;
    }
    for (int axis = 0; axis < 3; ++axis) values[i][axis] += share * value[axis];
  }
};

// Coefficients for which P of dyadic_tangent.hpp is dtheta/dF: F for the Green strain, else J H.
DyadicLanes measure_terms(const ZoneLanes& batch, const KinematicsLanes& kinematics) {
  DyadicLanes terms = {};
  for (int lane = 0; lane < batch.count; ++lane) {
    if (has_strain_measure(*batch.materials[lane])) {
      terms.identity.set(lane, 1.0);
    } else {
      terms.transposed.set(lane, -kinematics.J[lane]);
    }
  }
  return terms;
}

// Computes d(V theta)/du of each element at its nodes.
template <int kNodes>
NodalLanes<kNodes> measure_gradients(const ZoneBatch<kNodes>& batch, const double* displacement) {
  const BatchKernels<kNodes>& kernels = batch_kernels<kNodes>();
  const NodalLanes<kNodes> nodal = gather(batch.elements, displacement);
  NodalLanes<kNodes> gradients = {};
  for (const auto& point : batch.elements.points) {
    KinematicsLanes kinematics;
    kernels.deform(point, nodal, kinematics);
    kernels.add_force(point, kinematics, measure_terms(batch, kinematics), gradients);
  }
  return gradients;
}

// Adds the elements of a patch in these batches to its gradient.
template <int kNodes>
void add_gradient(const ZoneBatch<kNodes>* batches, uint32_t count, uint32_t patch,
                  const double* displacement, const ZoneUnknowns& unknowns, PatchGradient& gradient) {
  for (uint32_t n = 0; n < count; ++n) {
    const ZoneBatch<kNodes>& batch = batches[n];
    bool holds = false;
    for (int lane = 0; lane < batch.count; ++lane) holds = holds || batch.patches[lane] == patch;
    if (!holds) continue;
    const NodalLanes<kNodes> sums = measure_gradients(batch, displacement);
    for (int lane = 0; lane < batch.count; ++lane) {
      if (batch.patches[lane] != patch) continue;
      for (size_t a = 0; a < kNodes; ++a) {
        const double value[3] = {sums[a][0][lane], sums[a][1][lane], sums[a][2][lane]};
        for_each_master(unknowns, batch.elements.nodes[a][static_cast<size_t>(lane)],
                        [&](uint32_t unknown, double share, const double* arm) {
                          double moved[3];
                          memcpy(moved, value, sizeof moved);
                          if (arm != nullptr) take_moment(arm, moved);
                          gradient.add(unknown, share, moved);
                        });
      }
    }
  }
}

// Adds U'' / V  G . (to - from), G at `from`, to ZonePatch::followed.
template <int kNodes>
void add_pressure_changes(const ZoneBatch<kNodes>* batches, uint32_t count, const double* from,
                          const double* to, ZonePatch* patches) {
  for (uint32_t n = 0; n < count; ++n) {
    const ZoneBatch<kNodes>& batch = batches[n];
    const NodalLanes<kNodes> gradients = measure_gradients(batch, from);
    for (int lane = 0; lane < batch.count; ++lane) {
      if (batch.patches[lane] == pack::kNoPatch) continue;
      ZonePatch& patch = patches[batch.patches[lane]];
      for (size_t a = 0; a < kNodes; ++a) {
        const int first = 3 * batch.elements.nodes[a][static_cast<size_t>(lane)];
        for (size_t i = 0; i < 3; ++i) {
          const size_t at = static_cast<size_t>(first) + i;
          patch.followed += patch.stiffness * gradients[a][i][lane] * (to[at] - from[at]);
        }
      }
    }
  }
}

}  // namespace

double share_volumes(const ZoneBatches& batches, const double* displacement) {
  if (batches.num_patches == 0) return 0;
  const uint32_t end = batches.first_patch + batches.num_patches;
  for (uint32_t p = batches.first_patch; p < end; ++p) batches.patches[p].measure = 0;
  add_measures(batches.linear, batches.num_linear, displacement, batches.patches);
  add_measures(batches.quadratic, batches.num_quadratic, displacement, batches.patches);
  double energy = 0;
  for (uint32_t p = batches.first_patch; p < end; ++p) {
    ZonePatch& patch = batches.patches[p];
    if (is_left_out(batches, p)) continue;
    const VolumeTerm term = volume_term(*patch.material, patch.measure / patch.volume);
    patch.pressure = term.pressure;
    patch.stiffness = term.stiffness / patch.volume;
    energy += patch.volume * term.energy;
  }
  return energy;
}

void add_dyads(const ZoneBatches& batches, const double* displacement, const ZoneUnknowns& unknowns,
               const Target& target) {
  for (uint32_t p = batches.first_patch; p < batches.first_patch + batches.num_patches; ++p) {
    if (is_left_out(batches, p)) continue;
    PatchGradient gradient;
    add_gradient(batches.linear, batches.num_linear, p, displacement, unknowns, gradient);
    add_gradient(batches.quadratic, batches.num_quadratic, p, displacement, unknowns, gradient);
    for (uint32_t b = 0; b < gradient.count; ++b) {
      for (uint32_t a = 0; a < gradient.count; ++a) {
        for (uint32_t k = 0; k < 3; ++k) {
          const double scaled = batches.patches[p].stiffness * gradient.values[b][k];
          for (uint32_t i = 0; i < 3; ++i) {
            const uint32_t row = gradient.first[a] + i;
            const uint32_t column = gradient.first[b] + k;
            if (row >= column) target.add(row, column, gradient.values[a][i] * scaled);
          }
        }
      }
    }
  }
}

void settle_pressures(const ZoneBatches& batches, const double* displacement) {
  share_volumes(batches, displacement);
  for (uint32_t p = batches.first_patch; p < batches.first_patch + batches.num_patches; ++p) {
    if (!is_left_out(batches, p)) batches.patches[p].followed = batches.patches[p].pressure;
  }
}

void follow_pressures(const ZoneBatches& batches, const double* from, const double* to, double part) {
  if (batches.num_patches == 0) return;
  share_volumes(batches, from);
  for (uint32_t p = batches.first_patch; p < batches.first_patch + batches.num_patches; ++p) {
    ZonePatch& patch = batches.patches[p];
    patch.followed += part * (patch.pressure - patch.followed);
  }
  add_pressure_changes(batches.linear, batches.num_linear, from, to, batches.patches);
  add_pressure_changes(batches.quadratic, batches.num_quadratic, from, to, batches.patches);
}

}  // namespace palpate
