#include <palpate/palpate.hpp>

#include <cstdio>
#include <cstdlib>

int main(int, char** argv) {
  palpate::Pack pack;
  const pal_status opened = pack.open(argv[1]);
  if (opened != PAL_STATUS_OK) return std::puts(pal_status_text(opened)), 1;
  pal_session_config config = pal_default_session_config(pack.get());
  config.max_tools = 1;
  size_t bytes = 0;  // all the memory that the session will ever use
  if (palpate::Session::required_bytes(pack, config, bytes) != PAL_STATUS_OK) return 1;
  auto* arena = static_cast<unsigned char*>(std::aligned_alloc(64, bytes));
  palpate::Session session;
  if (session.init(pack, config, {arena, bytes}) != PAL_STATUS_OK) return 1;
  if (session.hold(0, pal_default_hold(0)) != PAL_STATUS_OK) return 1;  // tool 0 grasps site 0
  for (int frame = 0; frame <= 5; ++frame) {                            // your 1 kHz loop pushes it down
    const pal_pose pose = {{0, 0, -0.1 * frame * pack.info().max_displacement}, {1, 0, 0, 0}};
    pal_tool_result answer = {};
    if (session.haptic_frame(0.001, {&pose, 1}, {&answer, 1}) != PAL_STATUS_OK) return 1;
    std::printf("pushed %.5f, force %.5f\n", -pose.position[2], -answer.force[2]);
  }
  std::free(arena);
}
