#include <palpate/palpate.hpp>

#include <cstdio>
#include <cstdlib>

int main(int, char** argv) {
  palpate::Pack pack;
  if (pal_status status = pack.open(argv[1]); status != PAL_STATUS_OK) return std::puts(pal_status_text(status)), 1;
  const pal_session_config config = pal_default_session_config(pack.get());
  size_t bytes = 0;
  if (palpate::Session::required_bytes(pack, config, bytes) != PAL_STATUS_OK) return 1;
  auto* arena = static_cast<unsigned char*>(std::aligned_alloc(64, bytes));  // all the memory it will ever use
  palpate::Session session;
  if (session.init(pack, config, {arena, bytes}) != PAL_STATUS_OK) return 1;
  for (int frame = 1; frame <= 5; ++frame) {  // your 1 kHz loop
    const pal_contact contact = {0, {0, 0, -0.1 * frame * pack.info().max_displacement}};  // site 0, pushed down
    pal_contact_result answer = {};
    if (session.haptic_frame({&contact, 1}, {&answer, 1}) != PAL_STATUS_OK) return 1;
    std::printf("pushed %.5f, force %.5f\n", -contact.displacement[2], -answer.force[2]);
  }
  std::free(arena);
}
