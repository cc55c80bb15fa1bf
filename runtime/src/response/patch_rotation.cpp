#include "runtime/src/response/patch_rotation.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

constexpr double kMostTurn = 1.4142135623730951;  // 2 sin(90 degrees / 2)

}  // namespace

bool shorten_turn(double turn[3]) {
  const double size = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
  if (!(size > kMostTurn)) return false;
  for (int i = 0; i < 3; ++i) turn[i] *= kMostTurn / size;
  return true;
}

bool has_turns(const TissueState& tissue) {
  return tissue.zone.room.axes_per_contact > 3;
}

bool take_turns(TissueState& tissue, const pal_contact* contacts, uint32_t count, const double* turns) {
  if (!has_turns(tissue)) return false;
  find_places(*tissue.pack, contacts, tissue.zone.active);
  double* turn = tissue.displacements + size_t{3} * count;
  memset(turn, 0, size_t{3} * count * sizeof *turn);
  bool is_any_turned = false;
  for (uint32_t c = 0; c < count && turns != nullptr; ++c, turns += 3, turn += 3) {
    memcpy(turn, turns, 3 * sizeof *turn);
    if (shorten_turn(turn)) tissue.input_flags[c] |= PAL_FLAG_CLAMPED;
    is_any_turned = is_any_turned || turn[0] != 0 || turn[1] != 0 || turn[2] != 0;
  }
  return is_any_turned;
}

}  // namespace palpate
