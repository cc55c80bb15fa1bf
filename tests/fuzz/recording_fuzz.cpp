// Replays arbitrary bytes as a recording, on a session of a pack of the corpus.
#include <palpate/palpate.h>

#include <fstream>
#include <iterator>
#include <vector>

#include "runtime/src/session/recording_format.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/signed_pack.hpp"

namespace palpate::fuzz {
namespace {

const pal_pack* open_pack() {
  alignas(16) static unsigned char storage[PAL_PACK_STORAGE_BYTES];
  pal_pack* pack = nullptr;
  if (const pal_status status =
          pal_pack_open(PALPATE_FUZZ_PACK, PAL_VERIFY_ONCE, storage, sizeof storage, &pack);
      status != PAL_STATUS_OK) {
    std::fprintf(stderr, "%s: %s; renew the seeds (tests/fuzz/README.md)\n", PALPATE_FUZZ_PACK,
                 pal_status_text(status));
    std::exit(1);
  }
  return pack;
}

// Signs the recording as one of this session: pack, processor and completed config.
void sign(const Memory& recording, const pal_pack& pack, const pal_session& session) {
  RecordingHeader header;
  std::memcpy(&header, recording.data(), sizeof header);
  header.pack_checksum = checksum_of_pack(pack);
  header.fuses = fuses(session);
  std::memcpy(recording.data(), &header, sizeof header);
  std::memcpy(recording.data() + sizeof header, &session.config, sizeof session.config);
}

}  // namespace
}  // namespace palpate::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace palpate::fuzz;
  static const pal_pack* pack = open_pack();
  const Memory recording = copy_of(data, size);
  pal_session_config config = {};
  config.struct_size = sizeof config;
  if (pal_recording_get_config(recording.data(), size, &config) != PAL_STATUS_OK) return 0;
  const Memory arena = arena_for(pack, config);
  pal_session* session = nullptr;
  if (arena.size() == 0 ||
      pal_session_init(pack, &config, arena.data(), arena.size(), &session) != PAL_STATUS_OK)
    return 0;
  sign(recording, *pack, *session);
  pal_replay replay = {};
  replay.struct_size = sizeof replay;
  while (replay.ended == 0 && pal_session_replay(session, recording.data(), size, &replay) == PAL_STATUS_OK)
    require_finite<double>(replay.force);
  num_accepted += replay.ended;
  pal_pack_info info = {};
  info.struct_size = sizeof info;
  if (pal_pack_get_info(pack, &info) != PAL_STATUS_OK) std::abort();
  std::vector<pal_real> field(std::size_t{3} * info.num_nodes);
  if (pal_visual_frame(session, field.data(), 3 * sizeof(pal_real)) == PAL_STATUS_OK)
    require_finite<pal_real>(field);
  return 0;
}
