// Touch an organ: open a pack, hold a contact site, feel the force, see the tissue move.
#include <palpate/palpate.hpp>

#include <cstdio>
#include <vector>

int main(int argc, char** argv) {
  palpate::Pack pack;
  pal_status status = pack.open(argc > 1 ? argv[1] : "organ.pack");
  if (status != PAL_STATUS_OK) return std::fprintf(stderr, "%s\n", pal_status_text(status)), 1;

  const pal_session_config config = pal_default_session_config(pack.get());
  size_t bytes = 0;
  if (palpate::Session::required_bytes(pack, config, bytes) != PAL_STATUS_OK) return 1;
  std::vector<unsigned char> memory(bytes + 64);  // the only memory the session will ever use
  unsigned char* arena = memory.data() + (64 - reinterpret_cast<uintptr_t>(memory.data()) % 64);
  palpate::Session session;
  if (session.init(pack, config, {arena, bytes}) != PAL_STATUS_OK) return 1;

  const double depth = 0.5 * pack.info().max_displacement;  // metres, where the scene states its units
  for (int frame = 1; frame <= 5; ++frame) {                // your 1 kHz loop
    const pal_contact contact = {0, {0.0, 0.0, -depth * frame / 5}};
    pal_contact_result result = {};
    if (session.haptic_frame({&contact, 1}, {&result, 1}) != PAL_STATUS_OK) return 1;
    std::printf("pushed %.6f, force %.6f\n", depth * frame / 5, -result.force[2]);
  }
  std::vector<float> displacements(3 * pack.info().num_nodes);
  return session.visual_frame(displacements.data()) == PAL_STATUS_OK ? 0 : 1;
}
