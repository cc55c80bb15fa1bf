#include "runtime/src/session/recording.hpp"

#include <string.h>

#include "runtime/src/session/recording_format.hpp"
#include "runtime/src/session/session_state.hpp"

namespace palpate {
namespace {

// Appends the pieces of a call to the buffer. The writer drops a call that does not fit whole.
class CallWriter {
 public:
  CallWriter(Recorder& recorder, Call call, size_t bytes) : recorder_(recorder) {
    if (recorder.buffer == nullptr || recorder.full) return;
    bytes = multiple_of_8(bytes);
    if (bytes > UINT32_MAX || recorder.capacity - recorder.used < sizeof(CallHeader) + bytes) {
      recorder.full = true;
      return;
    }
    at_ = recorder.buffer + recorder.used;
    end_ = at_ + sizeof(CallHeader) + bytes;
    memset(at_, 0, sizeof(CallHeader) + bytes);
    const CallHeader header = {call, static_cast<uint32_t>(bytes)};
    put(&header, sizeof header);
  }
  ~CallWriter() {
    if (end_ != nullptr) recorder_.used = static_cast<size_t>(end_ - recorder_.buffer);
  }
  CallWriter(const CallWriter&) = delete;
  CallWriter& operator=(const CallWriter&) = delete;

  void put(const void* from, size_t bytes) {
    if (at_ == nullptr || bytes == 0) return;
    memcpy(at_, from, bytes);
    at_ += bytes;
  }

 private:
  Recorder& recorder_;
  unsigned char* at_ = nullptr;
  unsigned char* end_ = nullptr;
};

void record_delivery(pal_session& session) {
  if (!session.tissue.is_delivered) return;
  const CallSubject subject = {0, 0};
  CallWriter writer(session.recorder, Call::delivery, sizeof subject);
  writer.put(&subject, sizeof subject);
}

}  // namespace

void record_fixed(pal_session& session, const uint32_t* contact_nodes, uint32_t count) {
  const CallSubject subject = {count, 0};
  CallWriter writer(session.recorder, Call::set_fixed, sizeof subject + count * sizeof *contact_nodes);
  writer.put(&subject, sizeof subject);
  writer.put(contact_nodes, count * sizeof *contact_nodes);
}

void record_hold(pal_session& session, uint32_t tool, const pal_hold& hold) {
  const CallSubject subject = {tool, 0};
  RecordedHold recorded = {};
  memcpy(&recorded.law, &hold.law, sizeof recorded.law);
  memcpy(recorded.sites, hold.sites, sizeof recorded.sites);
  memcpy(recorded.weights, hold.weights, sizeof recorded.weights);
  recorded.unstrained = hold.unstrained;
  CallWriter writer(session.recorder, Call::hold, sizeof subject + sizeof recorded);
  writer.put(&subject, sizeof subject);
  writer.put(&recorded, sizeof recorded);
}

void record_release(pal_session& session, uint32_t tool) {
  const CallSubject subject = {tool, 0};
  CallWriter writer(session.recorder, Call::release, sizeof subject);
  writer.put(&subject, sizeof subject);
}

void record_touch(pal_session& session, uint32_t tool, const pal_touch* touch) {
  const CallSubject subject = {tool, touch != nullptr};
  const size_t bytes = touch != nullptr ? sizeof *touch : 0;
  CallWriter writer(session.recorder, Call::set_touch, sizeof subject + bytes);
  writer.put(&subject, sizeof subject);
  writer.put(touch, bytes);
}

void record_gravity(pal_session& session, const double* acceleration) {
  const CallSubject subject = {0, acceleration != nullptr};
  const size_t bytes = acceleration != nullptr ? 3 * sizeof *acceleration : 0;
  CallWriter writer(session.recorder, Call::set_gravity, sizeof subject + bytes);
  writer.put(&subject, sizeof subject);
  writer.put(acceleration, bytes);
}

void record_inclusion(pal_session& session, const pal_inclusion* inclusion) {
  const CallSubject subject = {0, inclusion != nullptr};
  const size_t bytes = inclusion != nullptr ? sizeof *inclusion : 0;
  CallWriter writer(session.recorder, Call::set_inclusion, sizeof subject + bytes);
  writer.put(&subject, sizeof subject);
  writer.put(inclusion, bytes);
}

void record_orientations(pal_session& session, const double* orientations, uint32_t count) {
  const CallSubject subject = {count, 0};
  const size_t bytes = size_t{4} * count * sizeof *orientations;
  CallWriter writer(session.recorder, Call::set_orientations, sizeof subject + bytes);
  writer.put(&subject, sizeof subject);
  writer.put(orientations, bytes);
}

void record_contact_frame(pal_session& session, const pal_contact* contacts, uint32_t count,
                          const pal_contact_result* results) {
  if (session.recorder.buffer == nullptr) return;
  record_delivery(session);
  const CallSubject subject = {count, 0};
  const Answer answer = {digest_of(results, count)};
  CallWriter writer(session.recorder, Call::contact_frame,
                    sizeof subject + sizeof answer + count * (sizeof(RecordedContact) + kForceBytes));
  writer.put(&subject, sizeof subject);
  for (uint32_t c = 0; c < count; ++c) {
    RecordedContact contact = {contacts[c].site, contacts[c].force_axes, {}, {}, {}, {}};
    memcpy(contact.neighbours, contacts[c].neighbours, sizeof contact.neighbours);
    memcpy(contact.neighbour_weights, contacts[c].neighbour_weights, sizeof contact.neighbour_weights);
    for (uint32_t axis = 0; axis < 3; ++axis) {  // the value that was read along each axis
      const bool by_force = (contacts[c].force_axes >> axis & 1) != 0;
      (by_force ? contact.force : contact.displacement)[axis] =
          (by_force ? contacts[c].force : contacts[c].displacement)[axis];
    }
    writer.put(&contact, sizeof contact);
  }
  writer.put(&answer, sizeof answer);
  for (uint32_t c = 0; c < count; ++c) writer.put(results[c].force, kForceBytes);
}

void record_haptic_frame(pal_session& session, const pal_haptic_input& input,
                         const pal_tool_result* results) {
  if (session.recorder.buffer == nullptr) return;
  record_delivery(session);
  const CallSubject subject = {input.num_tools, input.ages != nullptr};
  const uint32_t tools = session.config.max_tools;
  const Answer answer = {digest_of(results, tools)};
  const size_t ages_bytes = input.ages != nullptr ? input.num_tools * sizeof *input.ages : 0;
  CallWriter writer(session.recorder, Call::haptic_frame,
                    sizeof subject + sizeof input.dt + input.num_tools * sizeof *input.poses + ages_bytes +
                        sizeof answer + tools * kForceBytes);
  writer.put(&subject, sizeof subject);
  writer.put(&input.dt, sizeof input.dt);
  writer.put(input.poses, input.num_tools * sizeof *input.poses);
  writer.put(input.ages, ages_bytes);
  writer.put(&answer, sizeof answer);
  for (uint32_t tool = 0; tool < tools; ++tool) writer.put(results[tool].force, kForceBytes);
}

}  // namespace palpate

extern "C" pal_status pal_session_record(pal_session* session, void* buffer, size_t buffer_bytes) noexcept {
  using palpate::RecordingHeader;
  if (session == nullptr || buffer == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (session->used || session->recorder.buffer != nullptr) return PAL_STATUS_ALREADY_USED;
  if (reinterpret_cast<uintptr_t>(buffer) % 8 != 0) return PAL_STATUS_ARENA_MISALIGNED;
  RecordingHeader header = {};
  if (buffer_bytes < sizeof header + sizeof session->config) return PAL_STATUS_CAPACITY_EXCEEDED;
  memcpy(header.magic, palpate::kRecordingMagic, sizeof header.magic);
  header.version = palpate::kRecordingVersion;
  header.config_bytes = sizeof session->config;
  header.pack_checksum = palpate::checksum_of_pack(*session->tissue.pack);
  header.fuses = palpate::fuses(*session);
  auto* bytes = static_cast<unsigned char*>(buffer);
  memcpy(bytes, &header, sizeof header);
  memcpy(bytes + sizeof header, &session->config, sizeof session->config);
  session->recorder = {bytes, buffer_bytes, sizeof header + sizeof session->config, false};
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_session_stop_recording(pal_session* session, size_t* bytes,
                                                 uint32_t* complete) noexcept {
  if (session == nullptr || bytes == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (session->recorder.buffer == nullptr) return PAL_STATUS_NOT_RECORDING;
  *bytes = session->recorder.used;
  if (complete != nullptr) *complete = session->recorder.full ? 0 : 1;
  session->recorder = {};
  session->used = true;
  return PAL_STATUS_OK;
}
