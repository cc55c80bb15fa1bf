// The refining lane of a session.
#include <palpate/palpate.h>

#include "runtime/src/base/floating_point_mode.hpp"
#include "runtime/src/base/sized_struct.hpp"
#include "runtime/src/session/session_state.hpp"

namespace palpate {
namespace {

constexpr uint32_t kFirstRefinementBytes = 32;
static_assert(kFirstRefinementBytes == sizeof(pal_refinement));

}  // namespace
}  // namespace palpate

extern "C" pal_status pal_session_refine(pal_session* session, uint64_t operations,
                                         pal_refinement* refinement) noexcept {
  if (session == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (session->tissue.zone.room.contacts == 0) return PAL_STATUS_NO_SUCH_MODEL;
  pal_refinement result = {};
  if (refinement != nullptr) {
    if (const pal_status status = palpate::read_sized(*refinement, palpate::kFirstRefinementBytes, result);
        status != PAL_STATUS_OK)
      return status;
  }
  const palpate::FloatingPointMode mode;
  const palpate::TissueState& tissue = session->tissue;
  palpate::Refinement& lane = session->tissue.refinement;
  const palpate::Refined refined =
      palpate::refine(*tissue.pack, tissue.zone.kernel, operations == 0 ? UINT64_MAX : operations, lane);
  if (refinement == nullptr) return PAL_STATUS_OK;
  result.delivered = refined == palpate::Refined::delivered ? 1 : 0;
  result.failed = refined == palpate::Refined::failed ? 1 : 0;
  result.waiting = refined == palpate::Refined::works || palpate::has_request(lane) ? 1 : 0;
  result.iterations = lane.history.iterations;
  result.change = result.delivered != 0 ? lane.mailbox.delivery.change * tissue.pack->metres : 0.0;
  return palpate::write_sized(result, palpate::kFirstRefinementBytes, *refinement);
}
