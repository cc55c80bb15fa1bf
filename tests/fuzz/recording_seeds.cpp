// recording_seeds PACK FOLDER: writes contacts.rec and tools.rec, recordings with every kind of call.
#include <palpate/palpate.h>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

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

void record(const pal_pack* pack, bool tools, const std::string& file) {
  pal_pack_info info = {};
  info.struct_size = sizeof info;
  require(pal_pack_get_info(pack, &info));
  pal_session_config config = pal_default_session_config(pack);
  config.max_tools = 2;
  config.max_fixed = 2;
  config.patches_turn = tools ? 0 : 1;
  config.seconds_per_operation = 1e-9;  // not measured: a renewal gives the same bytes
  std::size_t bytes = 0;
  require(pal_session_required_bytes(pack, &config, &bytes));
  std::vector<unsigned char> memory(bytes + 64);
  unsigned char* arena = memory.data() + 64 - reinterpret_cast<std::uintptr_t>(memory.data()) % 64;
  pal_session* session = nullptr;
  require(pal_session_init(pack, &config, arena, bytes, &session));
  std::vector<std::uint64_t> recording(1 << 12);
  require(pal_session_record(session, recording.data(), recording.size() * sizeof recording[0]));
  (tools ? play_tools : play_contacts)(session, info.max_displacement);
  std::uint32_t complete = 0;
  require(pal_session_stop_recording(session, &bytes, &complete));
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(recording.data()), static_cast<std::streamsize>(bytes));
  if (!stream || complete == 0) throw std::runtime_error("cannot write " + file);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return std::puts("usage: recording_seeds PACK FOLDER"), 1;
  try {
    alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES];
    pal_pack* pack = nullptr;
    require(pal_pack_open(argv[1], PAL_VERIFY_ONCE, storage, sizeof storage, &pack));
    record(pack, false, std::string(argv[2]) + "/contacts.rec");
    record(pack, true, std::string(argv[2]) + "/tools.rec");
    pal_pack_close(pack);
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "%s: %s\n", argv[1], error.what()), 1;
  }
}
