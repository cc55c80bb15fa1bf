#include <palpate/palpate.hpp>

#include <cstdio>
#include <cstdlib>

int main(int, char** argv) {
  palpate::Pack pack;
  const pal_status opened = pack.open(argv[1]);
  if (opened != PAL_STATUS_OK) return std::puts(pal_status_text(opened)), 1;
  const pal_session_config config = pal_default_session_config(pack.get());
  size_t bytes = 0;  // all the memory that the session will ever use
  if (palpate::Session::required_bytes(pack, config, bytes) != PAL_STATUS_OK) return 1;
  auto* arena = static_cast<unsigned char*>(std::aligned_alloc(64, bytes));
  palpate::Session session;
  if (session.init(pack, config, {arena, bytes}) != PAL_STATUS_OK) return 1;
  for (int frame = 1; frame <= 5; ++frame) {  // your 1 kHz loop pushes site 0 down
    const pal_contact contact = {0, {0, 0, -0.1 * frame * pack.info().max_displacement}};
    pal_contact_result answer = {};
    if (session.haptic_frame({&contact, 1}, {&answer, 1}) != PAL_STATUS_OK) return 1;
    std::printf("pushed %.5f, force %.5f\n", -contact.displacement[2], -answer.force[2]);
  }
  std::free(arena);
}
