#include "runtime/src/session/recording.hpp"

#include <string.h>

#include "runtime/src/base/checksum.hpp"
#include "runtime/src/base/sized_struct.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/session/session_state.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

constexpr char kRecordingMagic[8] = {'P', 'A', 'L', 'R', 'E', 'C', '\0', '\0'};
constexpr uint32_t kRecordingVersion = 4;
constexpr uint32_t kFirstReplayBytes = 88;
static_assert(kFirstReplayBytes == sizeof(pal_replay));

struct RecordingHeader {
  char magic[8];
  uint32_t version;
  uint32_t config_bytes;
  uint64_t pack_checksum;
  uint64_t fuses;  // 1: the processor fuses products and sums, which changes the last bits of results
};

enum class Call : uint32_t {
  set_fixed = 1,
  hold = 2,
  release = 3,
  set_touch = 4,
  contact_frame = 5,
  haptic_frame = 6,
  set_gravity = 7,
  set_inclusion = 8,
  set_orientations = 9,
};

struct CallHeader {
  Call call;
  uint32_t bytes;  // size of the input that follows
};

// The subject of a call: the number of its inputs, or its tool.
struct CallSubject {
  uint32_t subject;
  uint32_t has_more;  // 1: optional input follows, such as ages, a touch, an acceleration or an inclusion
};

// These structs hold inputs without padding: the bytes of padding are undefined and would change the file.
struct RecordedContact {
  uint32_t site;
  uint32_t force_axes;
  double displacement[3];
  double force[3];
  uint32_t neighbours[2];
  double neighbour_weights[2];
};
struct RecordedHold {
  uint32_t law;
  uint32_t sites[3];
  double weights[3];
  pal_pose unstrained;
};

struct Answer {
  uint64_t digest;  // XXH3-64 of the results
};

constexpr size_t kForceBytes = 3 * sizeof(double);

constexpr size_t multiple_of_8(size_t bytes) {
  return (bytes + 7) / 8 * 8;
}

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

template <typename Result>
uint64_t digest_of(const Result* results, uint32_t count) {
  return count == 0 ? 0 : digest_of_bytes(results, count * sizeof(Result));
}

uint64_t checksum_of_pack(const pal_pack& pack) {
  pack::PackHeader header;
  memcpy(&header, pack.bytes, sizeof header);
  return header.checksum;
}

// 1 unless the session uses the scalar kernels, which do not fuse products and sums.
uint64_t fuses(const pal_session& session) {
  InverseKernel kernels[kMostInverseKernels];
  list_inverse_kernels(kernels);
  return session.tissue.linear.assembly.inverse.kernel.multiply != kernels[0].multiply ? 1 : 0;
}

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

extern "C" pal_status pal_recording_get_config(const void* recording, size_t bytes,
                                               pal_session_config* config) noexcept {
  if (recording == nullptr || config == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  palpate::RecordingHeader header;
  if (const pal_status status = palpate::read_header(recording, bytes, header); status != PAL_STATUS_OK)
    return status;
  pal_session_config recorded;
  memcpy(static_cast<void*>(&recorded), static_cast<const unsigned char*>(recording) + sizeof header,
         sizeof recorded);
  // A file cannot name a function to call.
  recorded.clock = nullptr;
  recorded.clock_user = nullptr;
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
