#include "runtime/src/response/patch_rotation.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

constexpr double kMostTurn = 1.4142135623730951;  // 2 sin(90 degrees / 2)

double product(const double a[3], const double (*matrix)[kMostZoneAxes], uint32_t row, uint32_t column,
               const double b[3]) {
  double sum = 0;
  for (uint32_t i = 0; i < 3; ++i) {
    for (uint32_t j = 0; j < 3; ++j) sum += a[i] * matrix[row + i][column + j] * b[j];
  }
  return sum;
}

}  // namespace

bool shorten_turn(double turn[3]) {
  const double size = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
  if (!(size > kMostTurn)) return false;
  for (int i = 0; i < 3; ++i) turn[i] *= kMostTurn / size;
  return true;
}

bool has_turns(const TissueState& tissue) {
  return tissue.zone.axes_per_contact > 3;
}

bool take_turns(TissueState& tissue, const pal_contact* contacts, uint32_t count, const double* turns) {
  if (!has_turns(tissue)) return false;
  find_places(*tissue.pack, contacts, tissue.zone.active);
  double* to = tissue.displacements + size_t{3} * count;
  memset(to, 0, size_t{3} * count * sizeof *to);
  bool is_any_turned = false;
  for (uint32_t c = 0; c < count && turns != nullptr; ++c, turns += 3, to += 3) {
    memcpy(to, turns, 3 * sizeof *to);
    if (shorten_turn(to)) tissue.input_flags[c] |= PAL_FLAG_CLAMPED;
    is_any_turned = is_any_turned || to[0] != 0 || to[1] != 0 || to[2] != 0;
  }
  return is_any_turned;
}

double energy_of_turns(const TissueState& tissue, uint32_t row, uint32_t column, const pal_contact& of_row,
                       const double* row_turn, const pal_contact& of_column, const double* column_turn) {
  const ZoneSet& set = tissue.zone.active;
  const double metres = tissue.pack->metres;
  double row_moved[3];
  double column_moved[3];
  for (int i = 0; i < 3; ++i) {
    row_moved[i] = of_row.displacement[i] / metres;
    column_moved[i] = of_column.displacement[i] / metres;
  }
  const uint32_t behind = 3 * set.num_contacts;
  double energy =
      -0.5 * (product(row_moved, set.stiffness, 3 * row, behind + 3 * column, column_turn) +
              product(row_turn, set.stiffness, behind + 3 * row, 3 * column, column_moved) +
              product(row_turn, set.stiffness, behind + 3 * row, behind + 3 * column, column_turn));
  for (uint32_t i = 0; i < 3 && row == column; ++i) energy += set.force[behind + 3 * row + i] * row_turn[i];
  return energy * tissue.pack->newtons * metres;
}

}  // namespace palpate
