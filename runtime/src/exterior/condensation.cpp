#include "runtime/src/exterior/condensation.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

// Upper bounds of a front's size in any zone where the front hands up at most `kept_within` kept nodes.
struct FrontBound {
  size_t columns;
  size_t below;  // rows
  size_t stride() const { return elimination_stride(static_cast<uint32_t>(columns + below)); }
};

FrontBound bound_of(const pack::Front& front, uint32_t kept_within) {
  return {round_to_columns(3 * front.num_columns), size_t{3} * (front.num_rows + kept_within)};
}

// Calls visit(front, most kept nodes that the front may hand up): the nodes in the columns of its subtree.
template <typename Visit>
void for_each_bound(const OrganView& organ, uint32_t kept, Visit&& visit) {
  for (uint32_t f = 0; f < organ.num_fronts; ++f) {
    const pack::Front& front = organ.fronts[f];
    const uint32_t within =
        front.first_column + front.num_columns - organ.fronts[f + 1 - front.num_within].first_column;
    visit(front, std::min(kept, within));
  }
}

// Calls visit(child) for the children of a front. Their subtrees precede the front, without gaps (postorder).
template <typename Visit>
void for_each_child(const OrganView& organ, uint32_t front, Visit&& visit) {
  const uint32_t first = front + 1 - organ.fronts[front].num_within;
  for (uint32_t end = front; end > first; end -= organ.fronts[end - 1].num_within) visit(end - 1);
}

size_t update_size(const pack::Front& front) {
  return size_t{9} * front.num_rows * front.num_rows;
}

size_t all_updates(const OrganView& organ) {
  size_t sum = 0;
  for (uint32_t f = 0; f < organ.num_fronts; ++f) sum += update_size(organ.fronts[f]);
  return sum;
}

// Returns the most update entries that wait for their parents if no node is kept: sum of a^2 over updates of
// a rows. Kept nodes add b rows to an update. A kept node waits in one update at a time. So the sum of b is
// at most 3 kept, and sum (a + b)^2 <= 2 sum a^2 + 18 kept^2.
size_t most_pending_updates(const OrganView& organ) {
  size_t most = 0;
  size_t pending = 0;
  for (uint32_t f = 0; f < organ.num_fronts; ++f) {
    pending += update_size(organ.fronts[f]);
    most = std::max(most, pending);
    for_each_child(organ, f, [&](uint32_t child) { pending -= update_size(organ.fronts[child]); });
  }
  return most;
}

// Lists a front's nodes and gives each node its rows. Returns false if the room does not suffice.
bool list_front(const Exterior& exterior, CondensationScratch& scratch, Condensation& condensation) {
  const OrganView& organ = exterior.pack.organ;
  const pack::Front& front = organ.fronts[condensation.front];
  FrontFactor& factor = condensation.fronts[condensation.front];
  factor = {};
  uint32_t* nodes = condensation.nodes + condensation.nodes_used;
  factor.nodes = nodes;
  const size_t room = condensation.room.nodes - condensation.nodes_used;
  for (uint32_t c = 0; c < front.num_columns; ++c) {
    const uint32_t node = organ.order[front.first_column + c];
    if (condensation.roles[node] != NodeRole::eliminated) continue;
    if (factor.num_eliminated == room) return false;
    scratch.unknown_of[node] = 3 * factor.num_eliminated;
    nodes[factor.num_eliminated++] = node;
  }
  factor.columns = round_to_columns(3 * factor.num_eliminated);
  bool fits = true;
  const auto list_below = [&](uint32_t node) {
    if (condensation.roles[node] == NodeRole::absent || scratch.unknown_of[node] != kNoUnknown) return;
    fits = fits && factor.num_eliminated + factor.num_below < room;
    if (!fits) return;
    scratch.unknown_of[node] = factor.columns + 3 * factor.num_below;
    nodes[factor.num_eliminated + factor.num_below++] = node;
  };
  for (uint32_t i = 0; i < front.num_rows; ++i) list_below(organ.order[organ.rows[front.first_row + i]]);
  for (uint32_t c = 0; c < front.num_columns; ++c) list_below(organ.order[front.first_column + c]);
  for_each_child(organ, condensation.front, [&](uint32_t child) {
    const FrontFactor& of_child = condensation.fronts[child];
    for (uint32_t i = 0; i < of_child.num_below; ++i) list_below(of_child.nodes[of_child.num_eliminated + i]);
  });
  factor.stride = elimination_stride(factor.columns + 3 * factor.num_below);
  return fits;
}

// Adds a child's update to its parent's matrix. `unknown_of`: a node's first row in the matrix.
void add_update(const FrontFactor& child, const uint32_t* unknown_of, uint32_t stride, float* matrix) {
  const uint32_t* nodes = child.nodes + child.num_eliminated;
  const size_t size = size_t{3} * child.num_below;
  for (uint32_t b = 0; b < child.num_below; ++b) {
    const uint32_t column = unknown_of[nodes[b]];
    if (column == kNoUnknown) continue;  // only in a damaged pack
    for (uint32_t k = 0; k < 3; ++k) {
      const float* from = child.update + (3 * b + k) * size;
      for (uint32_t a = b; a < child.num_below; ++a) {
        const uint32_t row = unknown_of[nodes[a]];
        if (row == kNoUnknown) continue;
        for (uint32_t i = a == b ? k : 0; i < 3; ++i) {
          const uint32_t low = std::min(row + i, column + k);
          const uint32_t high = std::max(row + i, column + k);
          matrix[size_t{low} * stride + high] += from[3 * a + i];
        }
      }
    }
  }
}

constexpr uint64_t kOperationsPerEntry = 2;  // multiply-adds that take as long as clearing an entry

// Assembles the front from its elements and its children's updates. Returns the work in multiply-adds.
uint64_t assemble_front(const Exterior& exterior, CondensationScratch& scratch, Condensation& condensation) {
  const uint32_t index = condensation.front;
  const FrontFactor& factor = condensation.fronts[index];
  const uint32_t size = factor.columns + 3 * factor.num_below;
  memset(scratch.matrix, 0, size_t{factor.stride} * round_to_columns(size) * sizeof *scratch.matrix);
  uint64_t spent = kOperationsPerEntry * factor.stride * size;
  const ZoneBatches batches = batches_of_front(exterior.elements, exterior.zone_of_simd_lane, 0, index);
  const ZoneUnknowns unknowns = {scratch.unknown_of, nullptr, nullptr};
  add_zone_stiffness(batches, exterior.displacement, unknowns, scratch.matrix, factor.stride);
  spent += stiffness_operations(batches);
  for_each_child(exterior.pack.organ, index, [&](uint32_t child) {
    FrontFactor& of_child = condensation.fronts[child];
    add_update(of_child, scratch.unknown_of, factor.stride, scratch.matrix);
    const size_t entries = size_t{9} * of_child.num_below * of_child.num_below;
    spent += entries;
    if (condensation.is_own[child] == 0 || condensation.room.keeps_updates) return;
    condensation.updates_used -= entries;
    of_child.update = nullptr;
  });
  // A fixed axis gets a unit pivot if its node is eliminated, and zero if its node is below.
  for (uint32_t i = 0; i < factor.num_eliminated + factor.num_below; ++i) {
    const uint32_t axes = exterior.pack.organ.nodes[factor.nodes[i]].free_axes;
    for (uint32_t axis = 0; axis < 3 && axes != 7; ++axis) {
      if ((axes >> axis & 1) != 0) continue;
      const uint32_t unknown = scratch.unknown_of[factor.nodes[i]] + axis;
      drop_unknown(unknown, size, factor.stride, scratch.matrix);
      if (i >= factor.num_eliminated) scratch.matrix[size_t{unknown} * factor.stride + unknown] = 0;
    }
  }
  for (uint32_t pad = 3 * factor.num_eliminated; pad < factor.columns; ++pad)
    scratch.matrix[size_t{pad} * factor.stride + pad] = 1;
  return spent;
}

// Adds the update of a root to S. Returns false if an entry is not finite.
bool add_to_schur(const FrontFactor& factor, const CondensationScratch& scratch, Condensation& condensation) {
  bool is_finite = true;
  // `unknown_of` holds rows of S meanwhile; keep_front() has cleared the rows of the front.
  for (uint32_t i = 0; i < condensation.num_kept; ++i) scratch.unknown_of[condensation.kept[i]] = 3 * i;
  const uint32_t* nodes = factor.nodes + factor.num_eliminated;
  for (uint32_t b = 0; b < 3 * factor.num_below; ++b) {
    const size_t column = scratch.unknown_of[nodes[b / 3]] + b % 3;
    const float* from = scratch.matrix + size_t{factor.columns + b} * factor.stride + factor.columns;
    for (uint32_t a = b; a < 3 * factor.num_below; ++a) {
      const size_t row = scratch.unknown_of[nodes[a / 3]] + a % 3;
      const float entry = from[a];
      is_finite = is_finite && isfinite(entry);
      condensation.schur[column * condensation.schur_stride + row] += entry;
      if (a != b) condensation.schur[row * condensation.schur_stride + column] += entry;
    }
  }
  for (uint32_t i = 0; i < condensation.num_kept; ++i) scratch.unknown_of[condensation.kept[i]] = kNoUnknown;
  return is_finite;
}

// Stores the eliminated front, and adds a root to S. Returns false without room, or if S is not finite.
bool keep_front(const Exterior& exterior, CondensationScratch& scratch, Condensation& condensation) {
  FrontFactor& factor = condensation.fronts[condensation.front];
  const size_t panel = size_t{factor.stride} * factor.columns;
  const size_t below = size_t{3} * factor.num_below;
  const bool is_root = exterior.pack.organ.fronts[condensation.front].parent == pack::kNoFront;
  if (panel > condensation.room.panels - condensation.panels_used ||
      (!is_root && below * below > condensation.room.updates - condensation.updates_used))
    return false;
  factor.panel = condensation.panels + condensation.panels_used;
  condensation.panels_used += panel;
  memcpy(factor.panel, scratch.matrix, panel * sizeof *factor.panel);
  if (!is_root) {
    factor.update = condensation.updates + condensation.updates_used;
    condensation.updates_used += below * below;
    for (size_t b = 0; b < below; ++b) {
      const float* from = scratch.matrix + (factor.columns + b) * factor.stride + factor.columns;
      memcpy(factor.update + b * below + b, from + b, (below - b) * sizeof *from);
    }
  }
  const uint32_t listed = factor.num_eliminated + factor.num_below;
  for (uint32_t i = 0; i < listed; ++i) scratch.unknown_of[factor.nodes[i]] = kNoUnknown;
  condensation.nodes_used += listed;
  return !is_root || add_to_schur(factor, scratch, condensation);
}

// Clears the rows of the current front's nodes in the scratch, after a failure or an interruption.
void forget_front(Condensation& condensation, CondensationScratch& scratch) {
  condensation.is_assembled = false;
  const FrontFactor& factor = condensation.fronts[condensation.front];
  for (uint32_t i = 0; i < factor.num_eliminated + factor.num_below; ++i)
    scratch.unknown_of[factor.nodes[i]] = kNoUnknown;
}

}  // namespace

uint32_t* carve_front_of(const pal_pack& pack, Arena& arena) {
  return arena.take<uint32_t>(pack.organ.num_free);
}

bool fill_front_of(const pal_pack& pack, uint32_t* front_of) {
  const OrganView& organ = pack.organ;
  for (uint32_t node = 0; node < organ.num_free; ++node) front_of[node] = pack::kNoFront;
  for (uint32_t f = 0; f < organ.num_fronts; ++f) {
    for (uint32_t c = 0; c < organ.fronts[f].num_columns; ++c) {
      uint32_t& front = front_of[organ.order[organ.fronts[f].first_column + c]];
      if (front != pack::kNoFront) return false;
      front = f;
    }
  }
  return true;
}

CondensationRoom condensation_room(const pal_pack& pack, uint32_t kept) {
  CondensationRoom room = {kept, kept == 0, 0, 0, 0};
  for_each_bound(pack.organ, kept, [&](const pack::Front& front, uint32_t kept_within) {
    const FrontBound bound = bound_of(front, kept_within);
    room.nodes += front.num_columns + front.num_rows + kept_within;
    room.panels += bound.stride() * bound.columns;
  });
  room.updates = room.keeps_updates ? all_updates(pack.organ)
                                    : 2 * most_pending_updates(pack.organ) + 18 * size_t{kept} * kept;
  return room;
}

void carve_condensation(const pal_pack& pack, const CondensationRoom& room, Arena& arena,
                        Condensation& condensation) {
  condensation = {};
  condensation.room = room;
  condensation.num_fronts = pack.organ.num_fronts;
  condensation.fronts = arena.take<FrontFactor>(pack.organ.num_fronts);
  condensation.roles = arena.take<NodeRole>(pack.organ.num_nodes);
  condensation.is_own = arena.take<uint8_t>(pack.organ.num_fronts);
  condensation.kept = arena.take<uint32_t>(room.kept);
  const size_t stride = symmetric_stride(3 * room.kept);
  condensation.schur = arena.take<float>(stride * stride);
  condensation.nodes = arena.take<uint32_t>(room.nodes);
  condensation.panels = arena.take<float>(room.panels);
  condensation.updates = arena.take<float>(room.updates);
}

void carve_scratch(const pal_pack& pack, uint32_t kept, Arena& arena, CondensationScratch& scratch) {
  size_t matrix = 0;
  size_t columns = 0;
  size_t below = 0;
  for_each_bound(pack.organ, kept, [&](const pack::Front& front, uint32_t kept_within) {
    const FrontBound bound = bound_of(front, kept_within);
    matrix = std::max(matrix, bound.stride() * (bound.stride() + kEliminationColumns));
    columns = std::max(columns, bound.columns);
    below = std::max(below, bound.below);
  });
  scratch.kept = kept;
  scratch.matrix = arena.take<float>(matrix);
  scratch.unknown_of = arena.take<uint32_t>(pack.organ.num_nodes);
  scratch.columns = arena.take<double>(2 * columns);
  scratch.below = arena.take<double>(below + kEliminationColumns);
}

void clear_scratch(const pal_pack& pack, CondensationScratch& scratch) {
  for (uint32_t i = 0; i < pack.organ.num_nodes; ++i) scratch.unknown_of[i] = kNoUnknown;
}

void begin_condensation(const Exterior& exterior, const Condensation* whole, CondensationScratch& scratch,
                        Condensation& condensation) {
  const OrganView& organ = exterior.pack.organ;
  if (condensation.is_assembled) forget_front(condensation, scratch);
  condensation.front = condensation.column = 0;
  condensation.is_assembled = false;
  condensation.nodes_used = condensation.panels_used = condensation.updates_used = 0;
  condensation.schur_stride = symmetric_stride(3 * condensation.num_kept);
  memset(condensation.schur, 0,
         size_t{condensation.schur_stride} * condensation.schur_stride * sizeof *condensation.schur);
  memset(condensation.is_own, whole == nullptr ? 1 : 0, organ.num_fronts);
  for (uint32_t node = 0; node < organ.num_free && whole != nullptr; ++node) {
    if (condensation.roles[node] == whole->roles[node]) continue;
    for (uint32_t f = exterior.front_of[node]; f != pack::kNoFront && condensation.is_own[f] == 0;
         f = organ.fronts[f].parent)
      condensation.is_own[f] = 1;
  }
  for (uint32_t f = 0; f < organ.num_fronts; ++f) {
    if (whole != nullptr && condensation.is_own[f] == 0) condensation.fronts[f] = whole->fronts[f];
  }
}

Progress advance_condensation(const Exterior& exterior, uint64_t operations, CondensationScratch& scratch,
                              Condensation& condensation, uint64_t& spent) {
  for (; condensation.front < condensation.num_fronts; ++condensation.front) {
    if (condensation.is_own[condensation.front] == 0) continue;
    if (!condensation.is_assembled) {
      if (spent >= operations) return Progress::goes_on;
      const bool fits = list_front(exterior, scratch, condensation);
      if (!fits) {
        forget_front(condensation, scratch);
        return Progress::failed;
      }
      spent += assemble_front(exterior, scratch, condensation);
      condensation.is_assembled = true;
      condensation.column = 0;
    }
    const FrontFactor& factor = condensation.fronts[condensation.front];
    const uint32_t size = factor.columns + 3 * factor.num_below;
    for (; condensation.column < size; condensation.column += kEliminationColumns) {
      if (spent >= operations) return Progress::goes_on;
      spent += elimination_operations(size, factor.columns, condensation.column);
      if (!exterior.kernel.eliminate_columns(scratch.matrix, factor.stride, size, factor.columns,
                                             condensation.column)) {
        forget_front(condensation, scratch);
        return Progress::failed;
      }
    }
    if (!keep_front(exterior, scratch, condensation)) {
      forget_front(condensation, scratch);
      return Progress::failed;
    }
    condensation.is_assembled = false;
  }
  return Progress::ended;
}

uint64_t forward_substitute_front(const Condensation& condensation, const EliminationKernel& kernel,
                                  uint32_t front, CondensationScratch& scratch, double* forces) {
  const FrontFactor& factor = condensation.fronts[front];
  if (factor.num_eliminated == 0) return 0;
  double* top = scratch.columns;
  for (uint32_t i = 0; i < factor.num_eliminated; ++i)
    memcpy(top + 3 * i, forces + size_t{3} * factor.nodes[i], 3 * sizeof *top);
  for (uint32_t i = 3 * factor.num_eliminated; i < factor.columns; ++i) top[i] = 0;
  kernel.forward_substitute(factor.panel, factor.stride, factor.columns, top);
  for (uint32_t i = 0; i < factor.num_eliminated; ++i)
    memcpy(forces + size_t{3} * factor.nodes[i], top + 3 * i, 3 * sizeof *top);
  const uint32_t rows = 3 * factor.num_below;
  memset(scratch.below, 0, round_to_columns(rows) * sizeof *scratch.below);
  kernel.add_product(factor.panel + factor.columns, factor.stride, rows, factor.columns, top, scratch.below);
  for (uint32_t i = 0; i < factor.num_below; ++i) {
    double* node = forces + size_t{3} * factor.nodes[factor.num_eliminated + i];
    for (uint32_t axis = 0; axis < 3; ++axis) node[axis] -= scratch.below[3 * i + axis];
  }
  return uint64_t{factor.stride} * factor.columns;
}

uint64_t backward_substitute_front(const Condensation& condensation, const EliminationKernel& kernel,
                                   uint32_t front, CondensationScratch& scratch, double* values) {
  const FrontFactor& factor = condensation.fronts[front];
  if (factor.num_eliminated == 0) return 0;
  double* top = scratch.columns;
  double* from_below = top + factor.columns;
  const uint32_t rows = round_to_columns(3 * factor.num_below);
  for (uint32_t i = 0; i < factor.num_below; ++i)
    memcpy(scratch.below + 3 * i, values + size_t{3} * factor.nodes[factor.num_eliminated + i],
           3 * sizeof *values);
  for (uint32_t i = 3 * factor.num_below; i < rows; ++i) scratch.below[i] = 0;
  memset(from_below, 0, factor.columns * sizeof *from_below);
  kernel.add_transposed_product(factor.panel + factor.columns, factor.stride, rows, factor.columns,
                                scratch.below, from_below);
  for (uint32_t i = 0; i < factor.num_eliminated; ++i) {
    for (uint32_t axis = 0; axis < 3; ++axis)
      top[3 * i + axis] = values[size_t{3} * factor.nodes[i] + axis] - from_below[3 * i + axis];
  }
  for (uint32_t i = 3 * factor.num_eliminated; i < factor.columns; ++i) top[i] = 0;
  kernel.back_substitute(factor.panel, factor.stride, factor.columns, top, 0, 1);
  for (uint32_t i = 0; i < factor.num_eliminated; ++i)
    memcpy(values + size_t{3} * factor.nodes[i], top + 3 * i, 3 * sizeof *top);
  return uint64_t{factor.stride} * factor.columns;
}

}  // namespace palpate
