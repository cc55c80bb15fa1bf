#include <palpate/palpate.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char** argv) {
  static _Alignas(16) char storage[PAL_PACK_STORAGE_BYTES];
  pal_pack* pack;
  const pal_status opened =
      pal_pack_open(argc > 1 ? argv[1] : "", PAL_VERIFY_ONCE, storage, sizeof storage, &pack);
  if (opened != PAL_STATUS_OK) return puts(pal_status_text(opened)), 1;
  const pal_session_config config = pal_default_session_config(pack);
  size_t bytes;  // all the memory that the session will ever use
  if (pal_session_required_bytes(pack, &config, &bytes) != PAL_STATUS_OK) return 1;
  void* arena = aligned_alloc(64, (bytes + 63) / 64 * 64);
  pal_session* session;
  if (pal_session_init(pack, &config, arena, bytes, &session) != PAL_STATUS_OK) return 1;
  const pal_hold grasp = pal_default_hold(0);  // tool 0 grasps site 0
  if (pal_tool_hold(session, 0, &grasp) != PAL_STATUS_OK) return 1;
  for (int frame = 0; frame <= 5; ++frame) {  // your 1 kHz loop: here it pushes down, 0.1 mm a frame
    const pal_pose pose = {{0, 0, -1e-4 * frame}, {1, 0, 0, 0}};
    const pal_haptic_input input = {sizeof input, 1, &pose, NULL, 0.001, sizeof(pal_tool_result), 1};
    pal_tool_result tool;
    if (pal_haptic_frame(session, &input, &tool) != PAL_STATUS_OK) return 1;
    printf("pushed %g, force %g\n", -pose.position[2], -tool.force[2]);  // the device plays -tool.force
  }
  free(arena);
  pal_pack_close(pack);
}
