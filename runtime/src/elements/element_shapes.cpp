// Shape gradients and volumes of elements in the mesh.
#include <math.h>

#include <algorithm>

#include "runtime/src/elements/zone_elements.hpp"

namespace palpate {
namespace {

// Computes dN_a / dL_i, i = 1 .. 3, at an integration point (tetrahedron_shape.hpp).
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
    double independent[10][4] = {};  // dN_a / dL_i as if all four L_i were independent
    for (int i = 0; i < 4; ++i) independent[i][i] = 4.0 * L[i] - 1.0;
    for (int edge = 0; edge < 6; ++edge) {
      const auto [i, j] = kEdges[edge];
      independent[4 + edge][i] = 4.0 * L[j];
      independent[4 + edge][j] = 4.0 * L[i];
    }
    for (int a = 0; a < 10; ++a) {
      for (int i = 0; i < 3; ++i) out[a][i] = independent[a][i + 1] - independent[a][0];
    }
  }
}

// Computes dN_a / dX at an integration point. Returns det(dX / dL) / 6, the volume if dX / dL were constant.
double global_gradients(int nodes, const double positions[kMostElementNodes][3], int point,
                        double out[kMostElementNodes][3]) {
  double local[kMostElementNodes][3];
  local_gradients(nodes, point, local);
  double M[3][3] = {};  // dX_i / dL_j, from positions relative to node 0: the local gradients sum to zero
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

// Writes the shape gradients and point volumes of a lane. Returns false if a volume is not positive.
template <int kNodes>
bool set_shape(const pack::OrganNode* mesh, const pack::OrganElement& element, int lane,
               ElementBatch<kNodes>& elements) {
  double positions[kMostElementNodes][3];
  for (size_t a = 0; a < kNodes; ++a) {
    const double* position = mesh[element.nodes[a]].position;
    for (int i = 0; i < 3; ++i) positions[a][i] = position[i];
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

}  // namespace

void scale_volumes(const ZoneBatches& batches) {
  for (uint32_t p = batches.first_patch; p < batches.first_patch + batches.num_patches; ++p)
    batches.patches[p].volume = 0;
  scale_volumes_of(batches.linear, batches.num_linear, batches.patches);
  scale_volumes_of(batches.quadratic, batches.num_quadratic, batches.patches);
}

double steepest_gradient(const ZoneBatches& batches) {
  double largest = 0;
  for_each_lanes(batches, [&](const auto& batch, const auto*) {
    for (const auto& point : batch.elements.points) {
      for (int lane = 0; lane < kLanes; ++lane) {
        double sum = 0;
        for (const auto& gradient : point.gradients)
          sum += sqrt(gradient[0][lane] * gradient[0][lane] + gradient[1][lane] * gradient[1][lane] +
                      gradient[2][lane] * gradient[2][lane]);
        largest = std::max(largest, sum);
      }
    }
  });
  return largest;
}

template <int kNodes>
bool append_element(const pal_pack& pack, const pack::OrganElement& element, const uint32_t* place_of,
                    uint32_t patch, uint32_t index, ZonePatch* patches, ZoneBatch<kNodes>* batches) {
  ZoneBatch<kNodes>& batch = batches[index / kLanes];
  const int first = static_cast<int>(index % kLanes);
  batch.count = first + 1;
  for (int lane = first; lane < kLanes; ++lane) {
    if (!set_shape(pack.organ.nodes, element, lane, batch.elements)) return false;
    for (size_t a = 0; a < kNodes; ++a) {
      const uint32_t node = element.nodes[a];
      batch.elements.nodes[a][static_cast<size_t>(lane)] =
          static_cast<int>(place_of != nullptr ? place_of[node] : node);
    }
    batch.materials[lane] = pack.zone_materials + element.material;
    batch.patches[lane] = patch;
    batch.stiffness[lane] = 1;
    for (size_t p = 0; p < batch.volumes.size(); ++p)
      batch.volumes[p].set(lane, batch.elements.points[p].volume[lane]);
  }
  if (patch == pack::kNoPatch) return true;
  patches[patch].material = pack.zone_materials + element.material;
  for (const auto& point : batch.elements.points) patches[patch].volume += point.volume[first];
  return true;
}

template bool append_element<4>(const pal_pack&, const pack::OrganElement&, const uint32_t*, uint32_t,
                                uint32_t, ZonePatch*, ZoneBatch<4>*);
template bool append_element<10>(const pal_pack&, const pack::OrganElement&, const uint32_t*, uint32_t,
                                 uint32_t, ZonePatch*, ZoneBatch<10>*);

}  // namespace palpate
