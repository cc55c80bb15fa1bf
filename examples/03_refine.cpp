// refine PACK: a contact moves in on the haptic thread while a second thread refines the organ outside of the
// zone. The pack must have zones, as a pack of models/brain/brain_zone.toml has.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <palpate/palpate.hpp>
#include <thread>
#include <vector>

int main(int argc, char** argv) {
  if (argc != 2) return std::puts("usage: example_03_refine PACK"), 1;
  palpate::Pack pack;
  if (const pal_status opened = pack.open(argv[1]); opened != PAL_STATUS_OK)
    return std::puts(pal_status_text(opened)), 1;
  pal_session_config config = palpate::Session::default_config(pack);
  config.model = PAL_MODEL_ZONE;
  size_t bytes = 0;
  if (const pal_status status = palpate::Session::required_bytes(pack, config, bytes);
      status != PAL_STATUS_OK)
    return std::puts(pal_status_text(status)), 1;
  std::vector<unsigned char> memory(bytes + 64);
  unsigned char* arena = memory.data() + 64 - reinterpret_cast<uintptr_t>(memory.data()) % 64;
  palpate::Session session;
  if (session.init(pack, config, {arena, bytes}) != PAL_STATUS_OK) return 1;

  std::atomic<bool> running = true;
  std::thread refining([&] {
    while (running) {
      pal_refinement refinement = {};
      if (session.refine(0, refinement) != PAL_STATUS_OK) return;
      if (refinement.waiting == 0)  // nothing to do until the next frame
        std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
  });

  // Half a second on the way in, then half a second at rest, at 1 kHz.
  pal_status status = PAL_STATUS_OK;
  for (int frame = 0; frame <= 1000 && status == PAL_STATUS_OK; ++frame) {
    const double part = frame < 500 ? frame / 500.0 : 1.0;
    const pal_contact contact = {0, {0, 0, -0.8 * part * pack.info().max_displacement}, 0, {}, {}, {}};
    pal_contact_result result;
    status = session.contact_frame({&contact, 1}, {&result, 1});
    if (frame % 100 == 0)
      std::printf("%4d ms: force (%.6g, %.6g, %.6g), estimated error %.2g %%\n", frame, result.force[0],
                  result.force[1], result.force[2], 100 * result.force_error);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  running = false;
  refining.join();
  return status == PAL_STATUS_OK ? 0 : 1;
}
