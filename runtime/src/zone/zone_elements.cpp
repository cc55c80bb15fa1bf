#include "runtime/src/zone/zone_elements.hpp"

#include <math.h>
#include <string.h>

#include "runtime/kernels/dyadic_tangent.hpp"
#include "runtime/kernels/isotropic_law.hpp"
#include "runtime/src/numerics/pose.hpp"

namespace palpate {
namespace {

bool is_dyadic(const pack::ZoneMaterial& material) {
  return material.law == pack::ZoneLaw::compressible_neo_hookean || material.law == pack::ZoneLaw::yeoh;
}

DyadicTangent dyadic_tangent(const pack::ZoneMaterial& material, double I1, double J) {
  const double* c = material.constants;
  if (material.law == pack::ZoneLaw::compressible_neo_hookean)
    return compressible_neo_hookean_tangent(c[0], c[1], J);
  return yeoh_tangent({c[0], c[1], c[2], {c[3], c[4], c[5]}}, I1, J);
}

double dyadic_energy(const pack::ZoneMaterial& material, double I1, double J) {
  const double* c = material.constants;
  if (material.law == pack::ZoneLaw::compressible_neo_hookean)
    return compressible_neo_hookean_energy(c[0], c[1], I1, J);
  return yeoh_energy({c[0], c[1], c[2], {c[3], c[4], c[5]}}, I1, J);
}

// Of a lane whose law is none of these.
PrincipalTangent principal_tangent(const pack::ZoneMaterial& material, const KinematicsLanes& kinematics,
                                   int lane) {
  const double* c = material.constants;
  double F[3][3];
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) F[i][j] = kinematics.F[i][j][lane];
  }
  if (material.law == pack::ZoneLaw::st_venant_kirchhoff) return st_venant_kirchhoff_tangent(c[0], c[1], F);
  if (material.law == pack::ZoneLaw::linear_elastic) return linear_elastic_tangent(c[0], c[1], F);
  return ogden_tangent({{c[0], c[1], c[2]}, {c[3], c[4], c[5]}, {c[6], c[7], c[8]}}, F);
}

// U of offline/material/volume_split.hpp.
struct VolumeTerm {
  double energy;
  double pressure;
  double stiffness;
};

bool is_of_strain(const pack::ZoneMaterial& material) {
  return material.law == pack::ZoneLaw::st_venant_kirchhoff;
}

double volume_measure(const pack::ZoneMaterial& material, double I1, double J) {
  return is_of_strain(material) ? 0.5 * (I1 - 1.0) : J;
}

VolumeTerm volume_term(const pack::ZoneMaterial& material, double measure) {
  const double half_lambda[3] = {0.5 * material.constants[1], 0, 0};
  const double* d = material.law == pack::ZoneLaw::yeoh    ? material.constants + 3
                    : material.law == pack::ZoneLaw::ogden ? material.constants + 6
                                                           : half_lambda;
  const double change = measure - 1.0;
  const double v = change * change;
  return {v * (d[0] + v * (d[1] + v * d[2])), change * (2 * d[0] + v * (4 * d[1] + v * 6 * d[2])),
          2 * d[0] + v * (12 * d[1] + v * 30 * d[2])};
}

// A pressure in place of the element's own.
void replace_pressure(const pack::ZoneMaterial& material, double I1, double J, double pressure,
                      DyadicTangent& terms) {
  const VolumeTerm own = volume_term(material, volume_measure(material, I1, J));
  const double change = pressure - own.pressure;
  if (is_of_strain(material)) {
    terms.identity += change;
    terms.ff -= own.stiffness;
  } else {
    terms.transposed -= change * J;
    terms.hh += J * (change - own.stiffness * J);
  }
}

// What dyadic_tangent.hpp makes the force of: the laws that it knows, and the pressures that elements share.
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

// Whether a lane's element is left out. `left_out`: of the batch's first lane, or null.
bool is_left_out(const uint8_t* left_out, uint32_t batch, int lane) {
  return left_out != nullptr && left_out[uint32_t{kLanes} * batch + static_cast<uint32_t>(lane)] != 0;
}

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

template <int kNodes>
bool holds_left_out(const ZoneBatch<kNodes>* batches, uint32_t count, const uint8_t* left_out,
                    uint32_t patch) {
  for (uint32_t n = 0; n < count && left_out != nullptr; ++n) {
    for (int lane = 0; lane < batches[n].count; ++lane) {
      if (batches[n].patches[lane] == patch) return is_left_out(left_out, n, lane);
    }
  }
  return false;
}

// A volume patch is left out as a whole.
bool is_left_out(const ZoneBatches& batches, uint32_t patch) {
  return holds_left_out(batches.linear, batches.num_linear, batches.linear_left_out, patch) ||
         holds_left_out(batches.quadratic, batches.num_quadratic, batches.quadratic_left_out, patch);
}

// Makes the pressures of the patches; their energy.
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

constexpr int kMostElementNodes = 10;

// dN_a / dL_i, i = 1 .. 3, at an integration point: tetrahedron_shape.hpp says how they come about.
void local_gradients(int nodes, int point, double out[kMostElementNodes][3]) {
  if (nodes == 4) {
    for (int a = 0; a < 4; ++a) {
      for (int i = 0; i < 3; ++i) out[a][i] = a == 0 ? -1.0 : a == i + 1 ? 1.0 : 0.0;
    }
  } else {
    constexpr int kEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    double L[4];
    const double root = sqrt(5.0);
    for (int i = 0; i < 4; ++i) L[i] = i == point ? (5.0 + 3.0 * root) / 20.0 : (5.0 - root) / 20.0;
    double free[10][4] = {};  // as if L_0 were independent, too
    for (int i = 0; i < 4; ++i) free[i][i] = 4.0 * L[i] - 1.0;
    for (int edge = 0; edge < 6; ++edge) {
      const auto [i, j] = kEdges[edge];
      free[4 + edge][i] = 4.0 * L[j];
      free[4 + edge][j] = 4.0 * L[i];
    }
    for (int a = 0; a < 10; ++a) {
      for (int i = 0; i < 3; ++i) out[a][i] = free[a][i + 1] - free[a][0];
    }
  }
}

// Gradients in the mesh and the volume of the element if it were everywhere as at the point.
double global_gradients(int nodes, const double positions[kMostElementNodes][3], int point,
                        double out[kMostElementNodes][3]) {
  double local[kMostElementNodes][3];
  local_gradients(nodes, point, local);
  double M[3][3] = {};  // dX_i / dL_j, positions counted from the first
  for (int a = 1; a < nodes; ++a) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) M[i][j] += (positions[a][i] - positions[0][i]) * local[a][j];
    }
  }
  double cofactor[3][3];
  for (int i = 0; i < 3; ++i) {
    const double* next = M[(i + 1) % 3];
    const double* last = M[(i + 2) % 3];
    for (int j = 0; j < 3; ++j)
      cofactor[i][j] = next[(j + 1) % 3] * last[(j + 2) % 3] - next[(j + 2) % 3] * last[(j + 1) % 3];
  }
  const double determinant = M[0][0] * cofactor[0][0] + M[0][1] * cofactor[0][1] + M[0][2] * cofactor[0][2];
  for (int a = 0; a < nodes; ++a) {
    for (int i = 0; i < 3; ++i) {
      out[a][i] =
          (cofactor[i][0] * local[a][0] + cofactor[i][1] * local[a][1] + cofactor[i][2] * local[a][2]) /
          determinant;
    }
  }
  return determinant / 6.0;
}

// V P g_a of a lane.
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

// Of entry (row, column) of an element's lower triangle.
constexpr size_t lower_place(size_t nodes, size_t row, size_t column) {
  return column * 3 * nodes - column * (column - 1) / 2 - column + row;
}

// K_ab of a unit volume, shape gradients in the frame of N: with dF = n_r g_b^T, by isotropic_law.hpp, and turned back.
void find_principal_block(const PrincipalTangent& tangent, const double ga[3], const double gb[3],
                          double block[3][3]) {
  double half[3][3] = {};  // [p][k]: turned back on the right
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

// A block of an element's stiffness, and where it goes in the lower triangle of a matrix.
template <typename Number>
struct Target {
  Number* matrix;
  uint32_t stride;

  void add(uint32_t row, uint32_t column, double value) const {
    matrix[size_t{column} * stride + row] += static_cast<Number>(value);
  }
  // Of two nodes, to unknowns of their own.
  void add_block(const double block[3][3], uint32_t row, uint32_t column, double factor) const {
    for (uint32_t i = 0; i < 3; ++i) {
      for (uint32_t k = 0; k < 3; ++k) {
        const double value = factor * block[i][k];
        if (row > column) {
          add(row + i, column + k, value);
        } else if (row < column) {
          add(column + k, row + i, value);
        } else {  // both nodes move as one: the block and its transpose
          add(row + (i > k ? i : k), row + (i > k ? k : i), i == k ? 2 * value : value);
        }
      }
    }
  }
  // Of one node.
  void add_own(const double block[3][3], uint32_t row, double factor) const {
    for (uint32_t i = 0; i < 3; ++i) {
      for (uint32_t k = 0; k <= i; ++k) add(row + i, row + k, factor * block[i][k]);
    }
  }
};

// Calls use(first unknown, share, arm) for each that moves a node; the arm is null but for a rotation.
template <typename Use>
void for_each_master(const ZoneUnknowns& unknowns, int node, Use&& use) {
  const uint32_t own = unknowns.of_node[node];
  if (own == kNoUnknown) return;
  if (own != kHeldUnknown) {
    use(own, 1.0, nullptr);
    return;
  }
  for (uint32_t m = unknowns.first_master[node]; m < unknowns.first_master[node + 1]; ++m) {
    const ZoneMaster& master = unknowns.masters[m];
    use(master.unknown, master.share, nullptr);
    if (master.turn != kNoUnknown) use(master.turn, master.share, master.arm);
  }
}

// What a force on a node is to the rotation that moves it: arm x force.
void take_moment(const double* arm, double force[3]) {
  double moment[3] = {};
  add_cross(arm, force, moment);
  memcpy(force, moment, sizeof moment);
}

// A block of two nodes, by what moves them: [row's arm]x K [column's arm]x^T.
void take_moments(const double* row_arm, const double* column_arm, double block[3][3]) {
  for (uint32_t i = 0; i < 3 && column_arm != nullptr; ++i) take_moment(column_arm, block[i]);
  for (uint32_t k = 0; k < 3 && row_arm != nullptr; ++k) {
    double column[3] = {block[0][k], block[1][k], block[2][k]};
    take_moment(row_arm, column);
    for (uint32_t i = 0; i < 3; ++i) block[i][k] = column[i];
  }
}

// The block of two nodes of an element, `row_node` and `column_node` its places, to all that moves them.
template <typename Number>
void scatter_block(const double block[3][3], int row_node, int column_node, const ZoneUnknowns& unknowns,
                   const Target<Number>& target) {
  for_each_master(unknowns, row_node, [&](uint32_t row, double row_share, const double* row_arm) {
    for_each_master(unknowns, column_node,
                    [&](uint32_t column, double column_share, const double* column_arm) {
                      const bool is_own = row_node == column_node;
                      if (is_own && row < column) return;
                      double moved[3][3];
                      memcpy(moved, block, sizeof moved);
                      take_moments(row_arm, column_arm, moved);
                      const double factor = row_share * column_share;
                      if (is_own && row == column) {
                        target.add_own(moved, row, factor);
                      } else {
                        target.add_block(moved, row, column, factor);
                      }
                    });
  });
}

// An element at a node that contacts hold, or at a fixed one. `stiffness`: by lower_place().
template <typename Number>
void scatter_held(size_t nodes, const int* places, const Lanes* stiffness, int lane,
                  const ZoneUnknowns& unknowns, const Target<Number>& target) {
  for (size_t b = 0; b < nodes; ++b) {
    for (size_t a = b; a < nodes; ++a) {
      double block[3][3];
      for (size_t i = 0; i < 3; ++i) {
        for (size_t k = 0; k < 3; ++k) {
          const size_t row = 3 * a + i;
          const size_t column = 3 * b + k;
          block[i][k] = row >= column ? stiffness[lower_place(nodes, row, column)][lane]
                                      : stiffness[lower_place(nodes, column, row)][lane];
        }
      }
      scatter_block(block, places[a], places[b], unknowns, target);
    }
  }
}

template <typename Number>
void scatter_free(size_t nodes, const Lanes* stiffness, int lane, const uint32_t* first,
                  const Target<Number>& target) {
  for (size_t b = 0; b < nodes; ++b) {
    for (size_t k = 0; k < 3; ++k) {
      const size_t column = 3 * b + k;
      const Lanes* entries = stiffness + lower_place(nodes, 0, column);
      Number* to = target.matrix + size_t{first[b] + static_cast<uint32_t>(k)} * target.stride;
      for (size_t i = k; i < 3; ++i) to[first[b] + i] += static_cast<Number>(entries[3 * b + i][lane]);
      for (size_t a = b + 1; a < nodes; ++a) {
        if (first[a] > first[b]) {
          for (size_t i = 0; i < 3; ++i) to[first[a] + i] += static_cast<Number>(entries[3 * a + i][lane]);
        } else {
          for (size_t i = 0; i < 3; ++i)
            target.matrix[size_t{first[a] + static_cast<uint32_t>(i)} * target.stride + first[b] + k] +=
                static_cast<Number>(entries[3 * a + i][lane]);
        }
      }
    }
  }
}

// An element, `places` its nodes.
template <typename Number>
void scatter_stiffness(size_t nodes, const int* places, const Lanes* stiffness, int lane,
                       const ZoneUnknowns& unknowns, const Target<Number>& target) {
  uint32_t first[kMostElementNodes];
  bool free = true;
  for (size_t a = 0; a < nodes; ++a) {
    first[a] = unknowns.of_node[places[a]];
    free = free && first[a] < kHeldUnknown;
  }
  if (free) {
    scatter_free(nodes, stiffness, lane, first, target);
  } else {
    scatter_held(nodes, places, stiffness, lane, unknowns, target);
  }
}

// d(V theta) of a patch by the unknowns that move its nodes.
struct PatchGradient {
  static constexpr uint32_t kMost = pack::kMostPatchNodes + 2 * pack::kMostZoneContacts;
  uint32_t count = 0;
  uint32_t first[kMost];  // of three
  double values[kMost][3];

  void add(uint32_t unknown, double share, const double value[3]) {
    uint32_t i = 0;
    while (i < count && first[i] != unknown) ++i;
    if (i == count) {
      first[count++] = unknown;
      for (double& one : values[i]) one = 0;
    }
    for (int axis = 0; axis < 3; ++axis) values[i][axis] += share * value[axis];
  }
};

DyadicLanes measure_terms(const ZoneLanes& batch, const KinematicsLanes& kinematics) {
  DyadicLanes terms = {};
  for (int lane = 0; lane < batch.count; ++lane) {
    if (is_of_strain(*batch.materials[lane])) {
      terms.identity.set(lane, 1.0);
    } else {
      terms.transposed.set(lane, -kinematics.J[lane]);
    }
  }
  return terms;
}

// d(V theta)/du of each element.
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

template <typename Number>
void add_dyads(const ZoneBatches& batches, const double* displacement, const ZoneUnknowns& unknowns,
               const Target<Number>& target) {
  for (uint32_t p = batches.first_patch; p < batches.first_patch + batches.num_patches; ++p) {
    if (is_left_out(batches, p)) continue;
    PatchGradient gradient;
    add_gradient(batches.linear, batches.num_linear, p, displacement, unknowns, gradient);
    add_gradient(batches.quadratic, batches.num_quadratic, p, displacement, unknowns, gradient);
    for (uint32_t b = 0; b < gradient.count; ++b) {
      for (uint32_t a = 0; a < gradient.count; ++a) {
        for (uint32_t k = 0; k < 3; ++k) {
          const double of_column = batches.patches[p].stiffness * gradient.values[b][k];
          for (uint32_t i = 0; i < 3; ++i) {
            const uint32_t row = gradient.first[a] + i;
            const uint32_t column = gradient.first[b] + k;
            if (row >= column) target.add(row, column, gradient.values[a][i] * of_column);
          }
        }
      }
    }
  }
}

// Adds U'' / V  G . du, `from` one state `to` another, to the pressures that follow.
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

template <int kNodes>
void add_forces_of(const ZoneBatch<kNodes>* batches, uint32_t count, const ZonePatch* patches,
                   const uint8_t* left_out, const double* displacement, ZoneStrain& strain, double* forces) {
  const BatchKernels<kNodes>& kernels = batch_kernels<kNodes>();
  for (uint32_t n = 0; n < count; ++n) {
    const ZoneBatch<kNodes>& batch = batches[n];
    const NodalLanes<kNodes> nodal = gather(batch.elements, displacement);
    NodalLanes<kNodes> sums = {};
    for (const auto& point : batch.elements.points) {
      KinematicsLanes kinematics;
      kernels.deform(point, nodal, kinematics);
      kernels.add_force(point, kinematics, terms_of(batch, patches, &ZonePatch::pressure, kinematics), sums);
      for (int lane = 0; lane < batch.count; ++lane) {
        if (is_left_out(left_out, n, lane)) continue;
        const double J = kinematics.J[lane];
        const pack::ZoneMaterial& material = *batch.materials[lane];
        // Small strains know no inversion.
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
    for (size_t a = 0; a < kNodes && left_out != nullptr; ++a) {
      for (size_t i = 0; i < 3; ++i) {
        for (int lane = 0; lane < batch.count; ++lane) {
          if (is_left_out(left_out, n, lane)) sums[a][i].set(lane, 0.0);
        }
      }
    }
    scatter<kNodes>(batch.elements, batch.count, sums, forces);
  }
}

template <int kNodes, typename Number>
void add_stiffness_of(const ZoneBatch<kNodes>* batches, uint32_t count, const ZonePatch* patches,
                      const uint8_t* left_out, const double* displacement, const ZoneUnknowns& unknowns,
                      const Target<Number>& target) {
  const BatchKernels<kNodes>& kernels = batch_kernels<kNodes>();
  for (uint32_t n = 0; n < count; ++n) {
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
      if (is_left_out(left_out, n, lane)) continue;
      int places[kNodes];
      for (size_t a = 0; a < kNodes; ++a) places[a] = batch.elements.nodes[a][static_cast<size_t>(lane)];
      scatter_stiffness(kNodes, places, stiffness.data(), lane, unknowns, target);
    }
  }
}

template <int kNodes>
void scale_volumes_of(ZoneBatch<kNodes>* batches, uint32_t count, ZonePatch* patches) {
  for (uint32_t n = 0; n < count; ++n) {
    ZoneBatch<kNodes>& batch = batches[n];
    for (size_t p = 0; p < batch.volumes.size(); ++p) {
      for (int lane = 0; lane < kLanes; ++lane) {
        const double volume = batch.stiffness[lane] * batch.volumes[p][lane];
        batch.elements.points[p].volume.set(lane, volume);
        if (lane < batch.count && batch.patches[lane] != pack::kNoPatch)
          patches[batch.patches[lane]].volume += volume;
      }
    }
  }
}

}  // namespace

void scale_volumes(const ZoneBatches& batches) {
  for (uint32_t p = batches.first_patch; p < batches.first_patch + batches.num_patches; ++p)
    batches.patches[p].volume = 0;
  scale_volumes_of(batches.linear, batches.num_linear, batches.patches);
  scale_volumes_of(batches.quadratic, batches.num_quadratic, batches.patches);
}

double principal_stress(const pack::ZoneMaterial& material, const double stretches[3], size_t axis) {
  KinematicsLanes kinematics = {};
  double squares = 0;
  double J = 1;
  for (size_t i = 0; i < 3; ++i) {
    kinematics.F[i][i].set(0, stretches[i]);
    squares += stretches[i] * stretches[i];
    J *= stretches[i];
  }
  if (!is_dyadic(material))
    return principal_tangent(material, kinematics, 0).first_piola_kirchhoff[axis][axis];
  const DyadicTangent terms = dyadic_tangent(material, squares, J);
  return terms.identity * stretches[axis] - terms.transposed / stretches[axis];
}

template <int kNodes>
bool set_shape(const pack::ZoneNode* mesh, const pack::ZoneElement& element, const int nodes[kNodes],
               int lane, ElementBatch<kNodes>& elements) {
  double positions[kMostElementNodes][3];
  for (size_t a = 0; a < kNodes; ++a) {
    const double* position = mesh[element.nodes[a]].position;
    for (int i = 0; i < 3; ++i) positions[a][i] = position[i];
    elements.nodes[a][static_cast<size_t>(lane)] = nodes[a];
  }
  for (int p = 0; p < ElementBatch<kNodes>::kPoints; ++p) {
    auto& point = elements.points[static_cast<size_t>(p)];
    double gradients[kMostElementNodes][3];
    const double volume = global_gradients(kNodes, positions, p, gradients) / ElementBatch<kNodes>::kPoints;
    if (!(volume > 0)) return false;
    point.volume.set(lane, volume);
    for (size_t a = 0; a < kNodes; ++a) {
      for (size_t i = 0; i < 3; ++i) point.gradients[a][i].set(lane, gradients[a][i]);
    }
  }
  return true;
}

template <int kNodes>
bool set_zone_element(const pack::ZoneNode* mesh, const pack::ZoneMaterial* materials,
                      const pack::ZoneElement& element, const int nodes[kNodes], uint32_t patch, int lane,
                      ZoneBatch<kNodes>& batch) {
  if (!set_shape(mesh, element, nodes, lane, batch.elements)) return false;
  batch.materials[lane] = materials + element.material;
  batch.patches[lane] = patch;
  batch.stiffness[lane] = 1;
  for (size_t p = 0; p < batch.volumes.size(); ++p)
    batch.volumes[p].set(lane, batch.elements.points[p].volume[lane]);
  return true;
}

template bool set_shape<4>(const pack::ZoneNode*, const pack::ZoneElement&, const int[4], int,
                           ElementBatch<4>&);
template bool set_shape<10>(const pack::ZoneNode*, const pack::ZoneElement&, const int[10], int,
                            ElementBatch<10>&);
template bool set_zone_element<4>(const pack::ZoneNode*, const pack::ZoneMaterial*, const pack::ZoneElement&,
                                  const int[4], uint32_t, int, ZoneBatch<4>&);
template bool set_zone_element<10>(const pack::ZoneNode*, const pack::ZoneMaterial*, const pack::ZoneElement&,
                                   const int[10], uint32_t, int, ZoneBatch<10>&);

ZoneStrain add_zone_forces(const ZoneBatches& batches, const double* displacement, double* forces) {
  ZoneStrain strain = {share_volumes(batches, displacement), static_cast<double>(INFINITY)};
  add_forces_of(batches.linear, batches.num_linear, batches.patches, batches.linear_left_out, displacement,
                strain, forces);
  add_forces_of(batches.quadratic, batches.num_quadratic, batches.patches, batches.quadratic_left_out,
                displacement, strain, forces);
  return strain;
}

uint32_t num_parts(const ZoneBatches& batches) {
  return batches.num_patches > 0 ? 1 : batches.num_linear + batches.num_quadratic;
}

ZoneBatches part_of(const ZoneBatches& batches, uint32_t part) {
  ZoneBatches some = batches;
  if (some.num_patches > 0) return some;
  const bool is_linear = part < some.num_linear;
  if (is_linear) {
    some.linear += part;
  } else {
    some.quadratic += part - some.num_linear;
  }
  some.num_linear = is_linear ? 1 : 0;
  some.num_quadratic = is_linear ? 0 : 1;
  return some;
}

uint64_t force_operations(const ZoneBatches& batches) {
  constexpr uint64_t kDyadic = 600;      // an element of four nodes
  constexpr uint64_t kQuadratic = 20;    // as many of those
  constexpr uint64_t kPrincipal = 5000;  // more, of any other law
  uint64_t operations = kDyadic * kLanes * (batches.num_linear + kQuadratic * batches.num_quadratic);
  for_each_lanes(batches, [&](const ZoneLanes& lanes, auto) {
    for (int lane = 0; lane < lanes.count; ++lane) {
      if (!is_dyadic(*lanes.materials[lane])) operations += kPrincipal;
    }
  });
  return batches.num_patches > 0 ? 2 * operations : operations;
}

uint64_t stiffness_operations(const ZoneBatches& batches) {
  constexpr uint64_t kLinear = 3000;  // an element of four nodes
  constexpr uint64_t kQuadratic = 20;
  return kLinear * kLanes * (batches.num_linear + kQuadratic * batches.num_quadratic);
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

template <typename Number>
void add_zone_stiffness(const ZoneBatches& batches, const double* displacement, const ZoneUnknowns& unknowns,
                        Number* matrix, uint32_t stride) {
  const Target<Number> target = {matrix, stride};
  share_volumes(batches, displacement);
  add_stiffness_of(batches.linear, batches.num_linear, batches.patches, batches.linear_left_out, displacement,
                   unknowns, target);
  add_stiffness_of(batches.quadratic, batches.num_quadratic, batches.patches, batches.quadratic_left_out,
                   displacement, unknowns, target);
  add_dyads(batches, displacement, unknowns, target);
}

template void add_zone_stiffness(const ZoneBatches&, const double*, const ZoneUnknowns&, double*, uint32_t);
template void add_zone_stiffness(const ZoneBatches&, const double*, const ZoneUnknowns&, float*, uint32_t);

}  // namespace palpate
