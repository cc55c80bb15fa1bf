// The visual frame: displacements of the packed nodes, or of the requested nodes, of the last frame.
#include <string.h>

#include <palpate/palpate.h>

#include "runtime/src/base/floating_point_mode.hpp"
#include "runtime/src/linear/gravity.hpp"
#include "runtime/src/numerics/binary_search.hpp"
#include "runtime/src/pack/compliance.hpp"
#include "runtime/src/pack/compressed_compliance.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/polynomial/polynomial_field.hpp"
#include "runtime/src/response/response_at_point.hpp"
#include "runtime/src/session/session_state.hpp"

namespace palpate {
namespace {

const pal_real* turn_of(const FieldState& field) {
  return field.gravity_turned ? field.gravity_turn : nullptr;
}

bool has_corners(const FieldState& field) {
  return field.model == PAL_MODEL_POLYNOMIAL || field.model == PAL_MODEL_ZONE;
}

// A field, with the values that all its panels share.
struct ShownField {
  const FieldState& state;
  const BasisCombination* corners;  // [num_corners]
};

// Overwrites the displacement of nodes in a nonlinear zone by the zone's own displacement.
void write_own_nodes(const FieldState& field, uint32_t first, uint32_t count, pal_real* sum) {
  for (uint32_t i = 0; i < field.num_own; ++i) {
    const uint32_t place = field.own_nodes[i] - first * pack::kPanelNodes;
    if (place < count * pack::kPanelNodes)
      memcpy(sum + size_t{3} * place, field.own + size_t{3} * i, 3 * sizeof *sum);
  }
}

void copy_panels(const pal_real* field, uint32_t first, uint32_t count, pal_real* sum) {
  memcpy(sum, field + size_t{first} * pack::kPanelRows, size_t{count} * pack::kPanelRows * sizeof *sum);
}

// Adds U (d - d_e) of nonlinear_zone.hpp: the organ outside the zone follows the contacts' motion d - d_e.
void add_response(const pal_session& session, const FieldState& field, uint32_t first, uint32_t count,
                  pal_real* sum) {
  if (field.response == kNoField) return;
  const size_t size = field_size(*session.tissue.pack);
  const pal_real* columns = session.tissue.refinement.mailbox.fields[field.response] + size;
  for (uint32_t panel = 0; panel < count; ++panel)
    session.tissue.kernel.add_columns(columns + size_t{first + panel} * pack::kPanelRows, size,
                                      field.followed, field.num_followed, true,
                                      sum + size_t{panel} * pack::kPanelRows);
}

// sum = displacements of the nodes of `count` panels from `first` on.
void fill_panels(const pal_session& session, const ShownField& shown, uint32_t first, uint32_t count,
                 pal_real* sum) {
  const FieldState& field = shown.state;
  const pal_pack& pack = *session.tissue.pack;
  bool onto = true;  // `sum` holds values to add to
  if (field.refined_field != kNoField) {
    copy_panels(session.tissue.refinement.mailbox.fields[field.refined_field], first, count, sum);
  } else {
    onto = fill_rest(pack, session.tissue.kernel, turn_of(field), first, count, sum);
  }
  if (field.model == PAL_MODEL_LINEAR) {
    fill_compliance_field(pack, field.forces(), first, count, session.tissue.kernel, onto, sum);
    onto = true;
  }
  if (field.model == PAL_MODEL_ZONE) {
    if (!onto) clear_panels(count, sum);
    onto = true;
    add_response(session, field, first, count, sum);
    write_own_nodes(field, first, count, sum);
    if (!is_compressed(pack))
      fill_compliance_field(pack, field.moving_forces(), first, count, session.tissue.kernel, true, sum);
  }
  if (has_corners(field)) {
    for (uint32_t i = 0; i < field.num_corners; ++i, onto = true)
      fill_columns(shown.corners[i], first, count, session.tissue.kernel, onto, sum);
  }
  if (!onto) clear_panels(count, sum);
}

// Whether fill_panels writes each row once and reads none. The caller's memory may be slow to read.
bool writes_once(const pal_session& session, const FieldState& field) {
  return !session.tissue.pack->has_gravity && field.model != PAL_MODEL_ZONE &&
         (field.model != PAL_MODEL_LINEAR || field.num_held <= 1) &&
         (field.model != PAL_MODEL_POLYNOMIAL || field.num_corners == 1);
}

constexpr size_t kNodeBytes = 3 * sizeof(pal_real);

// Writes the first `count` nodes of `rows` to `out` and returns the end of the written range.
char* write_nodes(const pal_real* rows, uint32_t count, size_t stride_bytes, char* out) {
  if (stride_bytes == kNodeBytes) {
    memcpy(out, rows, count * kNodeBytes);
  } else {
    for (uint32_t node = 0; node < count; ++node)
      memcpy(out + node * stride_bytes, rows + size_t{3} * node, kNodeBytes);
  }
  return out + count * stride_bytes;
}

// Panels hold consecutive nodes unless the compliance is compressed.
void write_fields_in_order(const pal_session& session, const FieldState& field, size_t stride_bytes,
                           char* out) {
  BasisCombination corners[most_corners(kMostZoneContacts)];
  for (uint32_t i = 0; has_corners(field) && i < field.num_corners; ++i)
    combine_polynomial_basis(*session.tissue.pack, field.corners[i], corners[i]);
  const ShownField shown = {field, corners};
  alignas(64) pal_real rows[kMostPanelsAtOnce * pack::kPanelRows];
  if (session.num_requested == 0) {
    // Whole panels go straight to the caller's memory if the caller's nodes have the same layout.
    const bool direct = stride_bytes == kNodeBytes && writes_once(session, field) &&
                        reinterpret_cast<uintptr_t>(out) % alignof(pal_real) == 0;
    uint32_t left = session.tissue.pack->num_nodes;
    for (uint32_t first = 0; left > 0;) {
      const bool into_rows = !direct || left < pack::kPanelNodes;
      const uint32_t panels = into_rows ? pack::num_panels(left) : left / pack::kPanelNodes;
      const uint32_t count = panels < kMostPanelsAtOnce ? panels : kMostPanelsAtOnce;
      const uint32_t nodes = count * pack::kPanelNodes < left ? count * pack::kPanelNodes : left;
      fill_panels(session, shown, first, count, into_rows ? rows : reinterpret_cast<pal_real*>(out));
      out = into_rows ? write_nodes(rows, nodes, stride_bytes, out) : out + nodes * kNodeBytes;
      first += count;
      left -= nodes;
    }
    return;
  }
  uint32_t filled = UINT32_MAX;
  for (uint32_t i = 0; i < session.num_requested; ++i) {
    const uint32_t node = session.requested[i];
    const uint32_t wanted = node / pack::kPanelNodes;
    if (wanted != filled) fill_panels(session, shown, wanted, 1, rows);
    filled = wanted;
    out = write_nodes(rows + size_t{3} * (node % pack::kPanelNodes), 1, stride_bytes, out);
  }
}

// Writes the sum of the row and the node's displacement at rest, or adds the row to `out`.
void write_node(const pal_session& session, const FieldState& field, uint32_t node, bool adds, pal_real* row,
                char* out) {
  if (adds) {
    pal_real before[3];
    memcpy(before, out, kNodeBytes);
    for (int axis = 0; axis < 3; ++axis) row[axis] += before[axis];
  } else {
    add_rest(*session.tissue.pack, turn_of(field), node, row);
  }
  memcpy(out, row, kNodeBytes);
}

// The panels of a compressed compliance hold neighbours in space, whose places in `out` are arbitrary.
void write_fields_by_panel(const pal_session& session, const FieldState& field, const NodalForces& forces,
                           bool adds, size_t stride_bytes, char* out) {
  const pal_pack& pack = *session.tissue.pack;
  alignas(64) pal_real rows[kMostPanelsAtOnce * pack::kPanelRows];
  if (session.num_requested == 0) {
    for (uint32_t first = 0; first < pack.num_panels; first += kMostPanelsAtOnce) {
      const uint32_t left = pack.num_panels - first;
      const uint32_t count = left < kMostPanelsAtOnce ? left : kMostPanelsAtOnce;
      fill_compressed_field(pack, forces, first, count, session.tissue.kernel.add_columns, rows);
      for (uint32_t place = 0; place < count * pack::kPanelNodes; ++place) {
        const uint32_t node =
            pack.compressed_panels[first + place / pack::kPanelNodes].nodes[place % pack::kPanelNodes];
        if (node == pack::kNoNode) continue;
        write_node(session, field, node, adds, rows + size_t{3} * place, out + node * stride_bytes);
      }
    }
    return;
  }
  uint32_t filled = UINT32_MAX;
  for (uint32_t i = 0; i < session.num_requested; ++i) {
    const uint32_t index = session.requested_by_panel[i];
    const uint32_t place = pack.node_places[session.requested[index]];
    const uint32_t wanted = place / pack::kPanelNodes;
    if (wanted != filled)
      fill_compressed_field(pack, forces, wanted, 1, session.tissue.kernel.add_columns, rows);
    filled = wanted;
    write_node(session, field, session.requested[index], adds, rows + size_t{3} * (place % pack::kPanelNodes),
               out + index * stride_bytes);
  }
}

// Sorts the requested nodes in the order of the compressed panels.
void order_by_panel(pal_session& session) {
  uint32_t found = 0;
  for (uint32_t panel = 0; panel < session.tissue.pack->num_panels; ++panel) {
    for (const uint32_t node : session.tissue.pack->compressed_panels[panel].nodes) {
      const uint32_t place =
          find_sorted(session.num_requested, node, [&](uint32_t i) { return session.requested[i]; });
      if (place < session.num_requested && found < session.num_requested)
        session.requested_by_panel[found++] = place;
    }
  }
}

}  // namespace
}  // namespace palpate

extern "C" pal_status pal_session_request_nodes(pal_session* session, const uint32_t* nodes,
                                                uint32_t count) noexcept {
  if (session == nullptr || (nodes == nullptr && count > 0)) return PAL_STATUS_NULL_ARGUMENT;
  if (count > session->config.max_requested) return PAL_STATUS_CAPACITY_EXCEEDED;
  for (uint32_t i = 0; i < count; ++i) {
    if (nodes[i] >= session->tissue.pack->num_nodes) return PAL_STATUS_NO_SUCH_NODE;
    if (i > 0 && nodes[i] <= nodes[i - 1]) return PAL_STATUS_BAD_ARGUMENT;
  }
  for (uint32_t i = 0; i < count; ++i) session->requested[i] = nodes[i];
  session->num_requested = count;
  if (palpate::is_compressed(*session->tissue.pack)) palpate::order_by_panel(*session);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_visual_frame(pal_session* session, pal_real* displacements,
                                       size_t stride_bytes) noexcept {
  if (session == nullptr || displacements == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (stride_bytes < 3 * sizeof(pal_real)) return PAL_STATUS_BAD_ARGUMENT;
  const palpate::FieldState& field = palpate::acquire(session->tissue.snapshots);
  const palpate::FloatingPointMode mode;
  char* out = reinterpret_cast<char*>(displacements);
  const bool is_compressed = palpate::is_compressed(*session->tissue.pack);
  if (field.model == PAL_MODEL_LINEAR && is_compressed) {
    palpate::write_fields_by_panel(*session, field, field.forces(), false, stride_bytes, out);
  } else {
    palpate::write_fields_in_order(*session, field, stride_bytes, out);
    if (field.model == PAL_MODEL_ZONE && is_compressed && field.num_moved > 0)
      palpate::write_fields_by_panel(*session, field, field.moving_forces(), true, stride_bytes, out);
  }
  return PAL_STATUS_OK;
}
