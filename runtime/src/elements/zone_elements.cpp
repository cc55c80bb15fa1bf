#include "runtime/src/elements/zone_elements.hpp"

#include <math.h>

#include "runtime/src/elements/element_laws.hpp"
#include "runtime/src/elements/element_scatter.hpp"
#include "runtime/src/elements/shared_volumes.hpp"

namespace palpate {
namespace {

// Computes the coefficients of dyadic_tangent.hpp in each lane; zero for other laws. In volume patches, the
// member `pressure` of ZonePatch replaces U' of the element.
DyadicLanes terms_of(const ZoneLanes& batch, const ZonePatch* patches, double ZonePatch::*pressure,
                     const KinematicsLanes& kinematics) {
  DyadicLanes lanes;
  for (int lane = 0; lane < kLanes; ++lane) {
    const pack::ZoneMaterial& material = *batch.materials[lane];
    const double I1 = kinematics.I1[lane];
    const double J = kinematics.J[lane];
    DyadicTangent terms = is_dyadic(material) ? dyadic_tangent(material, I1, J) : DyadicTangent();
    if (batch.patches[lane] != pack::kNoPatch)
      replace_pressure(material, I1, J, patches[batch.patches[lane]].*pressure, terms);
    lanes.set(lane, terms);
  }
  return lanes;
}

// Adds V P g_a of one lane, with P of isotropic_law.hpp.
template <int kNodes>
void add_principal_force(const typename ElementBatch<kNodes>::Point& point, const PrincipalTangent& tangent,
                         int lane, NodalLanes<kNodes>& forces) {
  for (size_t a = 0; a < kNodes; ++a) {
    for (size_t i = 0; i < 3; ++i) {
      double sum = 0;
      for (size_t j = 0; j < 3; ++j) sum += tangent.first_piola_kirchhoff[i][j] * point.gradients[a][j][lane];
      forces[a][i].add(lane, point.volume[lane] * sum);
    }
  }
}

// Computes K_ab per unit volume by isotropic_law.hpp. `ga`, `gb`: shape gradients in the frame of N. `entry`:
// n_p . dP g_a for dF = n_r g_b^T. The products with n rotate the block from the frame of n to the axes.
void find_principal_block(const PrincipalTangent& tangent, const double ga[3], const double gb[3],
                          double block[3][3]) {
  double half[3][3] = {};  // [p][k]: only the columns are rotated
  for (size_t p = 0; p < 3; ++p) {
    for (size_t r = 0; r < 3; ++r) {
      double entry = ga[p] * gb[r] * tangent.second[p][r] + ga[r] * gb[p] * tangent.crossed[p][r];
      for (size_t q = 0; q < 3 && p == r; ++q) entry += ga[q] * gb[q] * tangent.direct[p][q];
      for (size_t k = 0; k < 3; ++k) half[p][k] += entry * tangent.current[r][k];
    }
  }
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      block[i][k] = 0;
      for (size_t p = 0; p < 3; ++p) block[i][k] += tangent.current[p][i] * half[p][k];
    }
  }
}

template <int kNodes>
void add_principal_stiffness(const typename ElementBatch<kNodes>::Point& point,
                             const PrincipalTangent& tangent, int lane, StiffnessLanes<kNodes>& stiffness) {
  double g[kNodes][3];  // in the frame of N
  for (size_t a = 0; a < kNodes; ++a) {
    for (size_t p = 0; p < 3; ++p) {
      g[a][p] = 0;
      for (size_t j = 0; j < 3; ++j) g[a][p] += tangent.reference[p][j] * point.gradients[a][j][lane];
    }
  }
  for (size_t b = 0; b < kNodes; ++b) {
    for (size_t a = b; a < kNodes; ++a) {
      double block[3][3];
      find_principal_block(tangent, g[a], g[b], block);
      for (size_t i = 0; i < 3; ++i) {
        for (size_t k = 0; k < (a == b ? i + 1 : 3); ++k)
          stiffness[lower_place(kNodes, 3 * a + i, 3 * b + k)].add(lane, point.volume[lane] * block[i][k]);
      }
    }
  }
}

template <int kNodes>
void add_forces_of(const ZoneBatch<kNodes>* batches, uint32_t count, const ZonePatch* patches,
                   const ZoneBatches::Kept& kept, const double* displacement, ZoneStrain& strain,
                   double* forces) {
  const BatchKernels<kNodes>& kernels = batch_kernels<kNodes>();
  for (uint32_t n = 0; n < count; ++n) {
    if (!kept.holds_any(n)) continue;
    const ZoneBatch<kNodes>& batch = batches[n];
    const NodalLanes<kNodes> nodal = gather(batch.elements, displacement);
    NodalLanes<kNodes> sums = {};
    for (const auto& point : batch.elements.points) {
      KinematicsLanes kinematics;
      kernels.deform(point, nodal, kinematics);
      kernels.add_force(point, kinematics, terms_of(batch, patches, &ZonePatch::pressure, kinematics), sums);
      for (int lane = 0; lane < batch.count; ++lane) {
        if (!kept.holds(n, lane)) continue;
        const double J = kinematics.J[lane];
        const pack::ZoneMaterial& material = *batch.materials[lane];
        // The small-strain law is defined for any det F.
        if (material.law != pack::ZoneLaw::linear_elastic && !(J >= strain.smallest_jacobian))
          strain.smallest_jacobian = isfinite(J) ? J : -static_cast<double>(INFINITY);
        if (batch.patches[lane] != pack::kNoPatch) {
          const double measure = volume_measure(material, kinematics.I1[lane], J);
          strain.energy -= point.volume[lane] * volume_term(material, measure).energy;
        }
        if (is_dyadic(material)) {
          strain.energy += point.volume[lane] * dyadic_energy(material, kinematics.I1[lane], J);
        } else {
          const PrincipalTangent tangent = principal_tangent(material, kinematics, lane);
          strain.energy += point.volume[lane] * tangent.energy;
          add_principal_force<kNodes>(point, tangent, lane, sums);
        }
      }
    }
    // Elements that are left out add nothing to their nodes.
    for (size_t a = 0; a < kNodes && kept.of_lane != nullptr; ++a) {
      for (size_t i = 0; i < 3; ++i) {
        for (int lane = 0; lane < batch.count; ++lane) {
          if (!kept.holds(n, lane)) sums[a][i].set(lane, 0.0);
        }
      }
    }
    scatter<kNodes>(batch.elements, batch.count, sums, forces);
  }
}

template <int kNodes>
void add_stiffness_of(const ZoneBatch<kNodes>* batches, uint32_t count, const ZonePatch* patches,
                      const ZoneBatches::Kept& kept, const double* displacement, const ZoneUnknowns& unknowns,
                      const Target& target) {
  const BatchKernels<kNodes>& kernels = batch_kernels<kNodes>();
  for (uint32_t n = 0; n < count; ++n) {
    if (!kept.holds_any(n)) continue;
    const ZoneBatch<kNodes>& batch = batches[n];
    const NodalLanes<kNodes> nodal = gather(batch.elements, displacement);
    StiffnessLanes<kNodes> stiffness = {};
    for (const auto& point : batch.elements.points) {
      KinematicsLanes kinematics;
      kernels.deform(point, nodal, kinematics);
      const DyadicLanes terms = terms_of(batch, patches, &ZonePatch::followed, kinematics);
      kernels.add_stiffness(point, kinematics, terms, stiffness);
      for (int lane = 0; lane < batch.count; ++lane) {
        if (is_dyadic(*batch.materials[lane])) continue;
        const PrincipalTangent tangent = principal_tangent(*batch.materials[lane], kinematics, lane);
        add_principal_stiffness<kNodes>(point, tangent, lane, stiffness);
      }
    }
    for (int lane = 0; lane < batch.count; ++lane) {
      if (!kept.holds(n, lane)) continue;
      int places[kNodes];
      for (size_t a = 0; a < kNodes; ++a) places[a] = batch.elements.nodes[a][static_cast<size_t>(lane)];
      scatter_stiffness(kNodes, places, stiffness.data(), lane, unknowns, target);
    }
  }
}

}  // namespace

ZoneStrain add_zone_forces(const ZoneBatches& batches, const double* displacement, double* forces) {
  ZoneStrain strain = {share_volumes(batches, displacement), static_cast<double>(INFINITY)};
  add_forces_of(batches.linear, batches.num_linear, batches.patches, batches.kept_linear, displacement,
                strain, forces);
  add_forces_of(batches.quadratic, batches.num_quadratic, batches.patches, batches.kept_quadratic,
                displacement, strain, forces);
  return strain;
}

uint64_t force_operations(const ZoneBatches& batches) {
  constexpr uint64_t kDyadic = 600;      // multiply-adds of a four-node element
  constexpr uint64_t kQuadratic = 20;    // a ten-node element costs as much as 20 four-node elements
  constexpr uint64_t kPrincipal = 5000;  // additional multiply-adds with a law of isotropic_law.hpp
  uint64_t operations = kDyadic * kLanes * (batches.num_linear + kQuadratic * batches.num_quadratic);
  for_each_lanes(batches, [&](const ZoneLanes& lanes, auto) {
    for (int lane = 0; lane < lanes.count; ++lane) {
      if (!is_dyadic(*lanes.materials[lane])) operations += kPrincipal;
    }
  });
  return batches.num_patches > 0 ? 2 * operations : operations;
}

uint64_t stiffness_operations(const ZoneBatches& batches) {
  constexpr uint64_t kLinear = 3000;   // multiply-adds of a four-node element
  constexpr uint64_t kQuadratic = 20;  // a ten-node element costs as much as 20 four-node elements
  uint64_t weighted_batches = 0;
  for (uint32_t n = 0; n < batches.num_linear; ++n)
    weighted_batches += batches.kept_linear.holds_any(n) ? 1 : 0;
  for (uint32_t n = 0; n < batches.num_quadratic; ++n)
    weighted_batches += batches.kept_quadratic.holds_any(n) ? kQuadratic : 0;
  return kLinear * kLanes * weighted_batches;
}

void add_zone_stiffness(const ZoneBatches& batches, const double* displacement, const ZoneUnknowns& unknowns,
                        float* matrix, uint32_t stride) {
  const Target target = {matrix, stride};
  share_volumes(batches, displacement);
  add_stiffness_of(batches.linear, batches.num_linear, batches.patches, batches.kept_linear, displacement,
                   unknowns, target);
  add_stiffness_of(batches.quadratic, batches.num_quadratic, batches.patches, batches.kept_quadratic,
                   displacement, unknowns, target);
  add_dyads(batches, displacement, unknowns, target);
}

}  // namespace palpate
