#include "runtime/src/pack/surface_bvh.hpp"

#include <float.h>
#include <math.h>
#include <string.h>

#include <initializer_list>

namespace palpate {
namespace {

constexpr double kLeastWeight = DBL_EPSILON;  // a smaller weight is rounding

using pack::BvhNode;

// Relative rounding of a distance plus the size of the surface. The search keeps candidates within this
// margin, so that the result does not depend on the search order.
constexpr double kRounding = 1e-14;
// A triangle with a smaller ratio of height to base counts as a line: its height direction is rounding.
constexpr double kFlat = 1e-12;

double dot(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void subtract(const double a[3], const double b[3], double difference[3]) {
  for (int i = 0; i < 3; ++i) difference[i] = a[i] - b[i];
}

// sum = a + t b
void add_scaled(const double a[3], double t, const double b[3], double sum[3]) {
  for (int i = 0; i < 3; ++i) sum[i] = a[i] + t * b[i];
}

// The feature of the nearest point: kEdge + k is the edge opposite corner k, kVertex + k is corner k.
constexpr uint32_t kFace = 0;
constexpr uint32_t kEdge = 1;
constexpr uint32_t kVertex = 4;

struct Nearest {
  double square;  // squared distance
  double weights[3];
  double offset[3];  // the point less the position
  uint32_t feature;
  uint32_t primitive;
};

// Below, corners and `offset` are relative to the position.
void take_vertex(const double corners[3][3], uint32_t k, Nearest& nearest) {
  nearest.square = dot(corners[k], corners[k]);
  for (uint32_t i = 0; i < 3; ++i) nearest.weights[i] = i == k ? 1 : 0;
  memcpy(nearest.offset, corners[k], sizeof nearest.offset);
  nearest.feature = kVertex + k;
}

// Updates `nearest` by the nearest point of the edge opposite corner k.
void try_edge(const double corners[3][3], uint32_t k, Nearest& nearest) {
  const uint32_t from = (k + 1) % 3;
  const uint32_t to = (k + 2) % 3;
  double edge[3];
  subtract(corners[to], corners[from], edge);
  const double length_square = dot(edge, edge);
  const double along = -dot(edge, corners[from]);
  double offset[3];
  double t = 0;
  uint32_t feature = kEdge + k;
  if (!(along > 0)) {
    feature = kVertex + from;
    memcpy(offset, corners[from], sizeof offset);
  } else if (along >= length_square) {
    t = 1;
    feature = kVertex + to;
    memcpy(offset, corners[to], sizeof offset);
  } else {
    t = along / length_square;
    add_scaled(corners[from], t, edge, offset);
  }
  const double square = dot(offset, offset);
  if (!(square < nearest.square)) return;
  nearest.square = square;
  nearest.weights[from] = 1 - t;
  nearest.weights[to] = t;
  nearest.weights[k] = 0;
  memcpy(nearest.offset, offset, sizeof offset);
  nearest.feature = feature;
}

// The nearest point of a triangle, by the barycentric signs of the perpendicular's foot (Ericson, Real-Time
// Collision Detection, 5.1.5). A Gram-Schmidt step replaces Ericson's differences of large products, so that
// slivers and far positions lose no digits. A triangle without area, such as a single site, uses its edges.
void find_nearest_on(const double corners[3][3], Nearest& nearest) {
  double ab[3];
  double ac[3];
  subtract(corners[1], corners[0], ab);
  subtract(corners[2], corners[0], ac);
  // A corner is nearest to a position beyond the corner along both edges, and to a position at the corner.
  const double b_ab = -dot(ab, corners[1]);
  const double c_ac = -dot(ac, corners[2]);
  if (dot(ab, corners[0]) >= 0 && dot(ac, corners[0]) >= 0) return take_vertex(corners, 0, nearest);
  if (b_ab >= 0 && -dot(ac, corners[1]) <= b_ab) return take_vertex(corners, 1, nearest);
  if (c_ac >= 0 && -dot(ab, corners[2]) <= c_ac) return take_vertex(corners, 2, nearest);
  const double ab_ab = dot(ab, ab);
  const double ac_ac = dot(ac, ac);
  double u = -1;
  double v = -1;
  double w = -1;
  if (ab_ab > 0) {
    const double shear = dot(ab, ac) / ab_ab;
    double height[3];  // from the line through corners 0 and 1 to corner 2
    add_scaled(ac, -shear, ab, height);
    const double height_square = dot(height, height);
    if (height_square > kFlat * kFlat * ac_ac) {
      // First removes the component along ab, because `height` is not exactly perpendicular to ab.
      const double along = -dot(ab, corners[0]) / ab_ab;
      double over[3];
      add_scaled(corners[0], along, ab, over);
      w = -dot(height, over) / height_square;
      v = along - w * shear;
      u = 1 - v - w;
    }
  }
  if (u >= 0 && v >= 0 && w >= 0) {
    add_scaled(corners[0], v, ab, nearest.offset);
    add_scaled(nearest.offset, w, ac, nearest.offset);
    nearest.square = dot(nearest.offset, nearest.offset);
    nearest.weights[0] = u;
    nearest.weights[1] = v;
    nearest.weights[2] = w;
    nearest.feature = kFace;
    return;
  }
  nearest.square = static_cast<double>(INFINITY);
  if (u < 0) try_edge(corners, 0, nearest);
  if (v < 0) try_edge(corners, 1, nearest);
  if (w < 0) try_edge(corners, 2, nearest);
}

const double* site_position(const pal_pack& pack, uint32_t site) {
  return pack.rest_positions + size_t{3} * pack.site_nodes[site];
}

double smaller(double a, double b) {
  return a < b ? a : b;
}
double larger(double a, double b) {
  return a > b ? a : b;
}

// Corners of a triangle, relative to the position.
struct Corners {
  double offsets[3][3];

  Corners(const pal_pack& pack, const double position[3], uint32_t primitive) {
    for (uint32_t k = 0; k < 3; ++k)
      subtract(site_position(pack, pack.primitives[size_t{3} * primitive + k]), position, offsets[k]);
  }

  // Squared distance to the triangle's box: a lower bound of the distance to the triangle, up to rounding.
  double square_from_box() const {
    double square = 0;
    for (int i = 0; i < 3; ++i) {
      const double least = smaller(smaller(offsets[0][i], offsets[1][i]), offsets[2][i]);
      const double most = larger(larger(offsets[0][i], offsets[1][i]), offsets[2][i]);
      const double beyond = larger(larger(least, -most), 0);
      square += beyond * beyond;
    }
    return square;
  }
};

Nearest nearest_on_primitive(const Corners& corners, uint32_t primitive) {
  Nearest nearest;
  nearest.primitive = primitive;
  find_nearest_on(corners.offsets, nearest);
  return nearest;
}

using Float4 = float __attribute__((vector_size(16)));

// The query position in float32, in four lanes; the last lane is unused.
struct BoxQuery {
  // The position, with a margin on each side for the rounding of positions and boxes.
  Float4 above;
  Float4 below;

  BoxQuery(const double at[3], const BvhNode& root) : above(), below() {
    float size = 0;
    for (int i = 0; i < 3; ++i) {
      above[i] = static_cast<float>(at[i]);
      for (const float coordinate : {above[i], root.min[i], root.max[i]}) {
        if (fabsf(coordinate) > size) size = fabsf(coordinate);
      }
    }
    const float slack = size * 4 * FLT_EPSILON;
    below = above - slack;
    above += slack;
  }

  // Squared distance to the box: a lower bound up to its own rounding. Zero inside.
  float square_distance(const BvhNode& node) const {
    Float4 min;
    Float4 max;
    memcpy(&min, node.min, sizeof min);
    memcpy(&max, node.max, sizeof max);
    min -= above;
    max = below - max;
    Float4 beyond = min > max ? min : max;
    beyond = beyond > 0 ? beyond : Float4{};
    beyond *= beyond;
    return beyond[0] + beyond[1] + beyond[2];
  }
};

// An upper bound of `square` that covers the rounding of a box distance.
float above_roundings(double square) {
  return static_cast<float>(square) * (1 + 16 * FLT_EPSILON) + FLT_MIN;
}

// The nearest primitive so far, and the squared distance that bounds the search.
struct Search {
  const pal_pack& pack;
  const double* position;
  double size;  // size of the surface: no edge is longer
  BoxQuery boxes;
  Nearest nearest;
  float limit;

  void accept(const Nearest& nearer) {
    nearest = nearer;
    const double distance = sqrt(nearer.square);
    const double farthest = distance + kRounding * (distance + size);
    limit = above_roundings(farthest * farthest);
  }

  void visit(uint32_t primitive) {
    if (primitive == nearest.primitive) return;
    const Corners corners(pack, position, primitive);
    if (corners.square_from_box() > static_cast<double>(limit)) return;
    const Nearest found = nearest_on_primitive(corners, primitive);
    if (found.square < nearest.square ||
        (found.square == nearest.square && found.primitive < nearest.primitive)) {
      accept(found);
    }
  }
};

double size_of(const BvhNode& node) {
  double size = 0;
  for (int i = 0; i < 3; ++i) size += static_cast<double>(node.max[i]) - static_cast<double>(node.min[i]);
  return size;
}

SurfaceVisits search_tree(Search& search) {
  struct Waiting {
    const BvhNode* node;
    float square;
  };
  Waiting waiting[pack::kMostBvhDepth];  // the farther child of each node on the way down
  uint32_t num_waiting = 0;
  SurfaceVisits visits = {1, 1};
  const BvhNode* node = search.pack.bvh_nodes;
  while (node != nullptr) {
    const BvhNode* next = nullptr;
    if (node->count > 0) {
      for (uint32_t i = 0; i < node->count; ++i) search.visit(node->first + i);
      visits.primitives += node->count;
    } else {
      Waiting near = {node + 1, search.boxes.square_distance(node[1])};
      const BvhNode* right = search.pack.bvh_nodes + node->first;
      Waiting far = {right, search.boxes.square_distance(*right)};
      visits.nodes += 2;
      if (far.square < near.square) {
        const Waiting left = near;
        near = far;
        far = left;
      }
      if (far.square <= search.limit) waiting[num_waiting++] = far;
      if (near.square <= search.limit) next = near.node;
    }
    while (next == nullptr && num_waiting > 0) {
      const Waiting& last = waiting[--num_waiting];
      if (last.square <= search.limit) next = last.node;
    }
    node = next;
  }
  return visits;
}

const float* normal_of(const pal_pack& pack, const Nearest& nearest) {
  if (nearest.feature < kVertex)
    return pack.primitive_normals + size_t{12} * nearest.primitive + size_t{3} * nearest.feature;
  const uint32_t corner = nearest.feature - kVertex;
  return pack.site_normals + size_t{3} * pack.primitives[size_t{3} * nearest.primitive + corner];
}

void fill_hit(const pal_pack& pack, const Nearest& nearest, SurfaceHit& hit) {
  hit.primitive = nearest.primitive;
  const double* corners[3];
  for (uint32_t k = 0; k < 3; ++k) {
    hit.sites[k] = pack.primitives[size_t{3} * nearest.primitive + k];
    hit.weights[k] = nearest.weights[k] > kLeastWeight ? nearest.weights[k] : 0;
    corners[k] = site_position(pack, hit.sites[k]);
  }
  const float* stored = normal_of(pack, nearest);
  for (int i = 0; i < 3; ++i) {
    hit.point[i] =
        hit.weights[0] * corners[0][i] + hit.weights[1] * corners[1][i] + hit.weights[2] * corners[2][i];
    hit.normal[i] = static_cast<double>(stored[i]);
  }
  const double length = sqrt(dot(hit.normal, hit.normal));
  for (double& component : hit.normal) component /= length;
  const double distance = sqrt(nearest.square);
  hit.distance = dot(nearest.offset, hit.normal) > 0 ? -distance : distance;
}

bool holds(const BvhNode& box, const double point[3]) {
  for (int i = 0; i < 3; ++i) {
    if (!(point[i] >= static_cast<double>(box.min[i]) && point[i] <= static_cast<double>(box.max[i])))
      return false;
  }
  return true;
}

bool holds(const BvhNode& box, const BvhNode& inner) {
  for (int i = 0; i < 3; ++i) {
    if (!(inner.min[i] >= box.min[i] && inner.min[i] <= inner.max[i] && inner.max[i] <= box.max[i]))
      return false;
  }
  return true;
}

bool holds_primitives(const pal_pack& pack, const BvhNode& leaf) {
  const uint32_t* corner = pack.primitives + size_t{3} * leaf.first;
  for (uint32_t i = 0; i < 3 * leaf.count; ++i) {
    if (!holds(leaf, site_position(pack, corner[i]))) return false;
  }
  return true;
}

}  // namespace

bool find_nearest_surface_point(const pal_pack& pack, const double position[3], uint32_t start_primitive,
                                SurfaceHit& hit, SurfaceVisits* visits) {
  if (pack.bvh_nodes == nullptr) return false;
  for (int i = 0; i < 3; ++i) {
    if (!(fabs(position[i]) <= kLargestPosition)) return false;
  }
  Search search = {pack, position, size_of(pack.bvh_nodes[0]), {position, pack.bvh_nodes[0]}, {}, 0};
  const uint32_t start = start_primitive < pack.num_primitives ? start_primitive : 0;
  search.accept(nearest_on_primitive(Corners(pack, position, start), start));
  const SurfaceVisits visited = search_tree(search);
  if (visits != nullptr) *visits = visited;
  fill_hit(pack, search.nearest, hit);
  return true;
}

bool is_surface_tree(const pal_pack& pack) {
  struct Pending {
    uint32_t right;
    uint32_t parent;
    uint32_t depth;  // depth of the right child
  };
  // Nodes whose left subtree is in progress. Each right child must come next when the left subtree ends.
  Pending pending[pack::kMostBvhDepth];
  uint32_t num_pending = 0;
  uint32_t next_primitive = 0;
  uint32_t parent = 0;  // parent of the current node; the root is its own parent
  uint32_t depth = 0;
  for (uint32_t index = 0; index < pack.num_bvh_nodes; ++index) {
    const BvhNode& node = pack.bvh_nodes[index];
    if (!holds(pack.bvh_nodes[parent], node)) return false;
    if (node.count == 0) {
      if (depth == pack::kMostBvhDepth) return false;
      pending[num_pending++] = {node.first, index, ++depth};
      parent = index;
      continue;
    }
    if (node.count > pack::kMostLeafPrimitives || node.first != next_primitive ||
        node.count > pack.num_primitives - next_primitive || !holds_primitives(pack, node)) {
      return false;
    }
    next_primitive += node.count;
    if (num_pending == 0) return index + 1 == pack.num_bvh_nodes && next_primitive == pack.num_primitives;
    const Pending& next = pending[--num_pending];
    if (next.right != index + 1) return false;
    parent = next.parent;
    depth = next.depth;
  }
  return false;
}

}  // namespace palpate
