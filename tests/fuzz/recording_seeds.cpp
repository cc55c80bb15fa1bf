// recording_seeds PACK FOLDER: writes recordings with every kind of call.
#include <palpate/palpate.h>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/src/session/recording_format.hpp"

namespace {

void require(pal_status status) {
  if (status != PAL_STATUS_OK) throw std::runtime_error(pal_status_text(status));
}

void play_contacts(pal_session* session, double reach) {
  const double gravity[3] = {5e-4, 0, -1.5e-3};
  require(pal_session_set_gravity(session, gravity));
  pal_inclusion inclusion = {sizeof inclusion, 0, {1e-4, 1e-4, 2e-4}, 5e-5, 4};
  require(pal_session_set_inclusion(session, &inclusion));
  const double turn[4] = {0.995, 0, 0.0998749217771909, 0};
  require(pal_session_set_orientations(session, turn, 1));
  const std::uint32_t fixed[2] = {0, 3};
  for (std::uint32_t count = 0; count <= 2; ++count) {
    require(pal_session_set_fixed(session, fixed, count));
    const pal_contact contacts[2] = {{0, {0, 0.2 * reach, -reach}, 0, {}, {1, 2}, {0.3, 0.2}},
                                     {2, {}, 4, {0, 0, -1e-6}, {}, {}}};
    pal_contact_result results[2];
    require(pal_contact_frame(session, contacts, count, results));
  }
  require(pal_session_set_gravity(session, nullptr));
  require(pal_session_set_inclusion(session, nullptr));
}

// Frames that take deliveries of the refining lane.
void play_refined(pal_session* session, double reach) {
  for (int frame = 1; frame <= 6; ++frame) {
    const pal_contact contact = {0, {0, 0.1 * reach, -0.1 * frame * reach}, 0, {}, {}, {}};
    pal_contact_result result;
    require(pal_contact_frame(session, &contact, 1, &result));
    require(pal_session_refine(session, frame % 2 == 0 ? 1000 : 0, nullptr));
  }
}

// Tool 0 holds a place between sites; tool 1 touches.
void play_tools(pal_session* session, double reach) {
  pal_hold hold = pal_default_hold(0);
  hold.sites[1] = 1;
  hold.weights[0] = 0.75;
  hold.weights[1] = 0.25;
  require(pal_tool_hold(session, 0, &hold));
  const pal_touch touch = {sizeof touch, PAL_LAW_TOUCH, {0, 0, 0}, 0};
  require(pal_tool_set_touch(session, 1, &touch));
  for (int frame = 0; frame < 8; ++frame) {
    if (frame == 5) require(pal_tool_release(session, 0));
    const double depth = 0.2 * frame * reach;
    const pal_pose poses[2] = {{{depth, 0, -depth}, {1, 0, 0, 0}},
                               {{1.25e-4, 1.25e-4, 2.55e-4 - depth}, {0.8, 0, 0, 0.6}}};
    const double ages[2] = {0, 0.02 * frame};
    pal_tool_result results[2];
    const pal_haptic_input input = {sizeof input,    2, poses, frame % 2 == 0 ? ages : nullptr, 0.001,
                                    sizeof *results, 2};
    require(pal_haptic_frame(session, &input, results));
  }
  require(pal_tool_set_touch(session, 1, nullptr));
}

// Appends zeros to each call. A replay passes over them, and a changed count alone then reaches the check of the count.
std::vector<unsigned char> with_room(const unsigned char* recording, std::size_t bytes) {
  std::size_t at = sizeof(palpate::RecordingHeader) + sizeof(pal_session_config);
  std::vector<unsigned char> longer(recording, recording + at);
  while (at < bytes) {
    constexpr std::uint32_t kRoom = 256;
    palpate::CallHeader call;
    std::memcpy(static_cast<void*>(&call), recording + at, sizeof call);
    const std::size_t begin = longer.size();
    longer.insert(longer.end(), recording + at, recording + at + sizeof call + call.bytes);
    at += sizeof call + call.bytes;
    longer.resize(longer.size() + kRoom);
    call.bytes += kRoom;
    std::memcpy(longer.data() + begin, &call, sizeof call);
  }
  return longer;
}

// Calls as long as a session allows.
void play_long_calls(pal_session* session, double reach) {
  const std::vector<std::uint32_t> fixed(1024);
  require(pal_session_set_fixed(session, fixed.data(), 1024));
  const pal_contact contact = {0, {0, 0, -reach}, 0, {}, {}, {}};
  const std::vector<pal_contact> contacts(64, contact);
  std::vector<pal_contact_result> results(64);
  require(pal_contact_frame(session, contacts.data(), 64, results.data()));
}

void record(const pal_pack* pack, pal_session_config config, void (*play)(pal_session*, double),
            const std::string& file) {
  pal_pack_info info = {};
  info.struct_size = sizeof info;
  require(pal_pack_get_info(pack, &info));
  std::size_t bytes = 0;
  require(pal_session_required_bytes(pack, &config, &bytes));
  std::vector<unsigned char> memory(bytes + 64);
  unsigned char* arena = memory.data() + 64 - reinterpret_cast<std::uintptr_t>(memory.data()) % 64;
  pal_session* session = nullptr;
  require(pal_session_init(pack, &config, arena, bytes, &session));
  std::vector<std::uint64_t> recording(1 << 12);
  require(pal_session_record(session, recording.data(), recording.size() * sizeof recording[0]));
  play(session, info.max_displacement);
  std::uint32_t complete = 0;
  require(pal_session_stop_recording(session, &bytes, &complete));
  const std::vector<unsigned char> longer =
      with_room(reinterpret_cast<const unsigned char*>(recording.data()), bytes);
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(longer.data()), static_cast<std::streamsize>(longer.size()));
  if (!stream || complete == 0) throw std::runtime_error("cannot write " + file);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return std::puts("usage: recording_seeds PACK FOLDER"), 1;
  try {
    alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES];
    pal_pack* pack = nullptr;
    require(pal_pack_open(argv[1], PAL_VERIFY_ONCE, storage, sizeof storage, &pack));
    const std::string folder = argv[2];
    pal_session_config config = pal_default_session_config(pack);
    config.max_tools = 2;
    config.max_fixed = 2;
    record(pack, config, play_tools, folder + "/tools.rec");
    config.patches_turn = 1;
    record(pack, config, play_contacts, folder + "/contacts.rec");
    config = pal_default_session_config(pack);
    config.model = PAL_MODEL_ZONE;
    record(pack, config, play_refined, folder + "/refined.rec");
    config = pal_default_session_config(pack);
    config.model = PAL_MODEL_LINEAR;
    config.max_contacts = 64;
    config.max_fixed = 1024;
    record(pack, config, play_long_calls, folder + "/long_calls.rec");
    pal_pack_close(pack);
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "%s: %s\n", argv[1], error.what()), 1;
  }
}
