// record PACK OUT.rec: a tool touches the organ and leaves. `palpate replay PACK OUT.rec` repeats the calls.
#include <cmath>
#include <cstdio>
#include <palpate/palpate.hpp>
#include <string_view>
#include <vector>

int main(int argc, char** argv) {
  if (argc != 3 || std::string_view(argv[1]) == argv[2])
    return std::puts("usage: example_02_record PACK OUT.rec"), 1;
  palpate::Pack pack;
  if (const pal_status opened = pack.open(argv[1]); opened != PAL_STATUS_OK)
    return std::puts(pal_status_text(opened)), 1;
  const pal_session_config config = palpate::Session::default_config(pack);
  size_t bytes = 0;
  if (palpate::Session::required_bytes(pack, config, bytes) != PAL_STATUS_OK) return 1;
  std::vector<unsigned char> memory(bytes + 64);
  unsigned char* arena = memory.data() + 64 - reinterpret_cast<uintptr_t>(memory.data()) % 64;
  palpate::Session session;
  if (session.init(pack, config, {arena, bytes}) != PAL_STATUS_OK) return 1;

  std::vector<uint64_t> recording(1 << 17);  // about five seconds of four tools
  if (session.record(recording.data(), recording.size() * sizeof recording[0]) != PAL_STATUS_OK) return 1;

  // Start above the first site, on the surface's normal.
  const pal_geometry geometry = pack.geometry();
  uint32_t node = 0;
  if (pack.get_site_node(0, node) != PAL_STATUS_OK) return 1;
  const double scale = pack.info().metres_per_length_unit;
  double site[3];
  for (uint32_t i = 0; i < 3; ++i) site[i] = scale * geometry.positions[3 * node + i];
  pal_surface_point surface;
  if (pack.find_surface_point(site, surface) != PAL_STATUS_OK) return 1;

  pal_touch touch = {};
  touch.struct_size = sizeof touch;
  touch.law = PAL_LAW_TOUCH;
  if (session.set_touch(0, touch) != PAL_STATUS_OK) return 1;
  std::vector<pal_tool_result> results(config.max_tools);
  const double depth = 0.5 * pack.info().max_displacement;
  for (int frame = 0; frame <= 1000; ++frame) {  // one second at 1 kHz
    const double height = depth * std::cos(2 * 3.14159265358979 * frame / 1000);
    pal_pose pose = {{0, 0, 0}, {1, 0, 0, 0}};
    for (int i = 0; i < 3; ++i) pose.position[i] = surface.position[i] + height * surface.normal[i];
    if (session.haptic_frame(0.001, {&pose, 1}, results) != PAL_STATUS_OK) return 1;
    const pal_tool_result& tool = results[0];
    if (frame % 100 == 0) {
      std::printf("%4d ms  %9.5f above the surface  %u contacts  force %9.5f\n", frame, height,
                  tool.num_contacts, std::hypot(tool.force[0], tool.force[1], tool.force[2]));
    }
  }
  if (session.stop_recording(bytes) != PAL_STATUS_OK) return 1;
  std::FILE* file = std::fopen(argv[2], "wb");
  if (file == nullptr) return std::perror(argv[2]), 1;
  const bool saved = std::fwrite(recording.data(), 1, bytes, file) == bytes;
  if (std::fclose(file) != 0 || !saved) return std::perror(argv[2]), 1;
}
