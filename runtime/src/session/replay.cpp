// Replay: reads a recording and repeats its calls.
#include <string.h>

#include <palpate/palpate.h>

#include "runtime/src/base/sized_struct.hpp"
#include "runtime/src/session/recording_format.hpp"
#include "runtime/src/session/session_state.hpp"

namespace palpate {
namespace {

constexpr uint32_t kFirstReplayBytes = 88;
static_assert(kFirstReplayBytes == sizeof(pal_replay));

// Reads the pieces of a call back from a recording.
class CallReader {
 public:
  CallReader(const unsigned char* begin, size_t bytes) : at_(begin), left_(bytes) {}
  // Whether an answer of `count` forces follows. Replay asks before it repeats the call.
  bool has_answer(uint32_t count) const { return left_ >= sizeof(Answer) + count * kForceBytes; }
  template <typename T>
  bool take(T* to, size_t count) {
    if (count > left_ / sizeof(T)) return false;
    memcpy(static_cast<void*>(to), at_, count * sizeof(T));
    at_ += count * sizeof(T);
    left_ -= count * sizeof(T);
    return true;
  }

 private:
  const unsigned char* at_;
  size_t left_;
};

// Compares an answer with the recorded answer. The caller has checked has_answer().
template <typename Result>
void compare(CallReader& reader, const Result* results, uint32_t count, pal_replay& replay) {
  Answer answer = {};
  reader.take(&answer, 1);
  replay.diverged = answer.digest != digest_of(results, count);
  bool found = false;
  for (uint32_t i = 0; i < count && !found; ++i) {
    double force[3] = {};
    reader.take(force, 3);
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): a replay gives the same bits
    found = memcmp(force, results[i].force, kForceBytes) != 0;
    if (!found && i > 0) continue;
    replay.index = i;
    memcpy(replay.recorded_force, force, kForceBytes);
    memcpy(replay.force, results[i].force, kForceBytes);
  }
}

pal_status replay_fixed(pal_session& session, CallReader& reader, uint32_t count) {
  uint32_t nodes[kMostFixed];
  if (count > kMostFixed || !reader.take(nodes, count)) return PAL_STATUS_CORRUPT_RECORDING;
  return pal_session_set_fixed(&session, nodes, count);
}

pal_status replay_contacts(pal_session& session, CallReader& reader, uint32_t count, pal_replay& replay) {
  pal_contact contacts[pack::kMostContacts];
  pal_contact_result results[pack::kMostContacts];
  if (count > pack::kMostContacts) return PAL_STATUS_CORRUPT_RECORDING;
  for (uint32_t c = 0; c < count; ++c) {
    RecordedContact contact;
    if (!reader.take(&contact, 1)) return PAL_STATUS_CORRUPT_RECORDING;
    contacts[c].site = contact.site;
    contacts[c].force_axes = contact.force_axes;
    memcpy(contacts[c].displacement, contact.displacement, sizeof contact.displacement);
    memcpy(contacts[c].force, contact.force, sizeof contact.force);
    memcpy(contacts[c].neighbours, contact.neighbours, sizeof contact.neighbours);
    memcpy(contacts[c].neighbour_weights, contact.neighbour_weights, sizeof contact.neighbour_weights);
  }
  if (!reader.has_answer(count)) return PAL_STATUS_CORRUPT_RECORDING;
  if (const pal_status status = pal_contact_frame(&session, contacts, count, results);
      status != PAL_STATUS_OK)
    return status;
  ++replay.frames;
  compare(reader, results, count, replay);
  return PAL_STATUS_OK;
}

pal_status replay_tools(pal_session& session, CallReader& reader, const CallSubject& subject,
                        pal_replay& replay) {
  pal_pose poses[kMostTools];
  double ages[kMostTools];
  pal_tool_result results[kMostTools];
  pal_haptic_input input = {};
  input.struct_size = sizeof input;
  input.num_tools = subject.subject;
  input.poses = poses;
  input.ages = subject.has_more != 0 ? ages : nullptr;
  input.result_bytes = sizeof *results;
  input.num_results = session.config.max_tools;
  if (input.num_tools > kMostTools || !reader.take(&input.dt, 1) || !reader.take(poses, input.num_tools) ||
      (subject.has_more != 0 && !reader.take(ages, input.num_tools)) ||
      !reader.has_answer(session.config.max_tools))
    return PAL_STATUS_CORRUPT_RECORDING;
  if (const pal_status status = pal_haptic_frame(&session, &input, results); status != PAL_STATUS_OK)
    return status;
  ++replay.frames;
  replay.seconds += session.tools.dt;
  compare(reader, results, session.config.max_tools, replay);
  return PAL_STATUS_OK;
}

pal_status replay_call(pal_session& session, Call call, CallReader& reader, pal_replay& replay) {
  CallSubject subject;
  if (!reader.take(&subject, 1)) return PAL_STATUS_CORRUPT_RECORDING;
  switch (call) {
    case Call::set_fixed:
      return replay_fixed(session, reader, subject.subject);
    case Call::hold: {
      RecordedHold recorded;
      if (!reader.take(&recorded, 1)) return PAL_STATUS_CORRUPT_RECORDING;
      pal_hold hold = pal_default_hold(0);
      memcpy(&hold.law, &recorded.law, sizeof hold.law);
      memcpy(hold.sites, recorded.sites, sizeof hold.sites);
      memcpy(hold.weights, recorded.weights, sizeof hold.weights);
      hold.unstrained = recorded.unstrained;
      return pal_tool_hold(&session, subject.subject, &hold);
    }
    case Call::release:
      return pal_tool_release(&session, subject.subject);
    case Call::set_touch: {
      pal_touch touch;
      if (subject.has_more != 0 && !reader.take(&touch, 1)) return PAL_STATUS_CORRUPT_RECORDING;
      touch.struct_size = sizeof touch;
      return pal_tool_set_touch(&session, subject.subject, subject.has_more != 0 ? &touch : nullptr);
    }
    case Call::contact_frame:
      return replay_contacts(session, reader, subject.subject, replay);
    case Call::set_gravity: {
      double acceleration[3];
      if (subject.has_more != 0 && !reader.take(acceleration, 3)) return PAL_STATUS_CORRUPT_RECORDING;
      return pal_session_set_gravity(&session, subject.has_more != 0 ? acceleration : nullptr);
    }
    case Call::set_inclusion: {
      pal_inclusion inclusion;
      if (subject.has_more != 0 && !reader.take(&inclusion, 1)) return PAL_STATUS_CORRUPT_RECORDING;
      inclusion.struct_size = sizeof inclusion;
      return pal_session_set_inclusion(&session, subject.has_more != 0 ? &inclusion : nullptr);
    }
    case Call::set_orientations: {
      double orientations[4 * pack::kMostContacts];
      if (subject.subject > pack::kMostContacts || !reader.take(orientations, size_t{4} * subject.subject))
        return PAL_STATUS_CORRUPT_RECORDING;
      return pal_session_set_orientations(&session, orientations, subject.subject);
    }
    case Call::haptic_frame:
      return replay_tools(session, reader, subject, replay);
    case Call::delivery: {
      pal_refinement refinement = {};
      refinement.struct_size = sizeof refinement;
      const pal_status status = pal_session_refine(&session, 0, &refinement);
      const bool is_delivered = refinement.delivered != 0 || refinement.failed != 0;
      return status == PAL_STATUS_OK && is_delivered ? PAL_STATUS_OK : PAL_STATUS_CORRUPT_RECORDING;
    }
  }
  return PAL_STATUS_CORRUPT_RECORDING;
}

pal_status read_header(const void* recording, size_t bytes, RecordingHeader& header) {
  if (bytes < sizeof header) return PAL_STATUS_NOT_A_RECORDING;
  memcpy(&header, recording, sizeof header);
  if (memcmp(header.magic, kRecordingMagic, sizeof header.magic) != 0) return PAL_STATUS_NOT_A_RECORDING;
  if (header.version != kRecordingVersion) return PAL_STATUS_RECORDING_OF_OTHER_BUILD;
  // A config of another size belongs to another build.
  if (header.config_bytes != sizeof(pal_session_config)) return PAL_STATUS_RECORDING_OF_OTHER_BUILD;
  return bytes - sizeof header < header.config_bytes ? PAL_STATUS_CORRUPT_RECORDING : PAL_STATUS_OK;
}

}  // namespace
}  // namespace palpate

extern "C" pal_status pal_recording_get_config(const void* recording, size_t bytes,
                                               pal_session_config* config) noexcept {
  if (recording == nullptr || config == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  palpate::RecordingHeader header;
  if (const pal_status status = palpate::read_header(recording, bytes, header); status != PAL_STATUS_OK)
    return status;
  pal_session_config recorded;
  memcpy(static_cast<void*>(&recorded), static_cast<const unsigned char*>(recording) + sizeof header,
         sizeof recorded);
  return palpate::write_sized(recorded, palpate::kFirstConfigBytes, *config);
}

extern "C" pal_status pal_session_replay(pal_session* session, const void* recording, size_t bytes,
                                         pal_replay* given) noexcept {
  using palpate::CallHeader;
  if (session == nullptr || recording == nullptr || given == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  pal_replay replay = {};
  if (const pal_status status = palpate::read_sized(*given, palpate::kFirstReplayBytes, replay);
      status != PAL_STATUS_OK)
    return status;
  palpate::RecordingHeader header;
  if (const pal_status status = palpate::read_header(recording, bytes, header); status != PAL_STATUS_OK)
    return status;
  if (header.pack_checksum != palpate::checksum_of_pack(*session->tissue.pack))
    return PAL_STATUS_RECORDING_OF_OTHER_PACK;
  if (header.fuses != palpate::fuses(*session)) return PAL_STATUS_RECORDING_OF_OTHER_BUILD;
  const size_t first = sizeof header + header.config_bytes;
  if (replay.offset == 0) {
    if (session->used) return PAL_STATUS_ALREADY_USED;
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): padding is zero, and a config has the same bits
    if (memcmp(static_cast<const unsigned char*>(recording) + sizeof header, &session->config,
               sizeof session->config) != 0)
      return PAL_STATUS_BAD_ARGUMENT;
    replay.offset = first;
  }
  if (replay.offset < first || replay.offset > bytes || replay.offset % 8 != 0)
    return PAL_STATUS_CORRUPT_RECORDING;
  replay.diverged = 0;
  replay.index = 0;
  memset(replay.recorded_force, 0, sizeof replay.recorded_force);
  memset(replay.force, 0, sizeof replay.force);
  if (replay.offset == bytes) {
    replay.ended = 1;
    return palpate::write_sized(replay, palpate::kFirstReplayBytes, *given);
  }
  CallHeader call;
  const auto* at = static_cast<const unsigned char*>(recording) + replay.offset;
  const size_t left = bytes - replay.offset;
  if (left < sizeof call) return PAL_STATUS_CORRUPT_RECORDING;
  memcpy(static_cast<void*>(&call), at, sizeof call);
  if (call.bytes > left - sizeof call || call.bytes % 8 != 0) return PAL_STATUS_CORRUPT_RECORDING;
  palpate::CallReader reader(at + sizeof call, call.bytes);
  if (const pal_status status = palpate::replay_call(*session, call.call, reader, replay);
      status != PAL_STATUS_OK)
    return status;
  replay.offset += sizeof call + call.bytes;
  replay.ended = replay.offset == bytes;
  return palpate::write_sized(replay, palpate::kFirstReplayBytes, *given);
}
