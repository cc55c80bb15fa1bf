// The bytes of a recording (recording.hpp), which writer and replay share.
#pragma once

#include <string.h>

#include <palpate/palpate.h>

#include "runtime/src/base/checksum.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/session/session_state.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

inline constexpr char kRecordingMagic[8] = {'P', 'A', 'L', 'R', 'E', 'C', '\0', '\0'};
inline constexpr uint32_t kRecordingVersion = 6;

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
  // The next frame reads a delivery of the refining lane. Replay refines until the delivery is complete.
  delivery = 10,
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

// These structs have no padding, because bytes of padding are undefined and would change the file.
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

inline constexpr size_t kForceBytes = 3 * sizeof(double);

constexpr size_t multiple_of_8(size_t bytes) {
  return (bytes + 7) / 8 * 8;
}

template <typename Result>
uint64_t digest_of(const Result* results, uint32_t count) {
  return count == 0 ? 0 : digest_of_bytes(results, count * sizeof(Result));
}

inline uint64_t checksum_of_pack(const pal_pack& pack) {
  pack::PackHeader header;
  memcpy(&header, pack.bytes, sizeof header);
  return header.checksum;
}

// 1 unless the session uses the scalar kernels, which do not fuse products and sums.
inline uint64_t fuses(const pal_session& session) {
  InverseKernel kernels[kMostInverseKernels];
  list_inverse_kernels(kernels);
  return session.tissue.linear.assembly.inverse.kernel.multiply != kernels[0].multiply ? 1 : 0;
}

}  // namespace palpate
