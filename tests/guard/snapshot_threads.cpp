// snapshot_threads PACK [two-readers]: haptic frames on one thread, visual frames on another, under
// ThreadSanitizer. Every field that the reader sees must equal, to the bit, the field of some haptic frame.
// The header forbids two readers: with two-readers ThreadSanitizer must find the race (exit code 66), which
// proves the check.
#include <atomic>
#include <cstdio>
#include <cstring>
#include <memory>
#include <palpate/palpate.hpp>
#include <thread>
#include <vector>

namespace {

constexpr int kHapticFrames = 20000;

struct Simulation {
  std::vector<unsigned char> memory;
  palpate::Session session;

  bool init(const palpate::Pack& pack) {
    pal_session_config config = pal_default_session_config(pack.get());
    config.max_contacts = 3;
    size_t bytes = 0;
    if (palpate::Session::required_bytes(pack, config, bytes) != PAL_STATUS_OK) return false;
    memory.resize(bytes + 64);
    void* arena = memory.data();
    size_t room = memory.size();
    if (std::align(64, bytes, arena, room) == nullptr) return false;
    return session.init(pack, config, {static_cast<unsigned char*>(arena), bytes}) == PAL_STATUS_OK;
  }
};

// Contact sets: rest, one contact (polynomial), two contacts (linear).
std::vector<std::vector<pal_contact>> scenes(double push) {
  const pal_contact first = {0, {0, 0, -push}, 0, {}, {}, {}};
  const pal_contact second = {1, {push, 0, 0}, 0, {}, {}, {}};
  return {{}, {first}, {first, second}, {second}};
}

int run(const char* path, bool two_readers) {
  palpate::Pack pack;
  if (pack.open(path) != PAL_STATUS_OK) return 2;
  const pal_pack_info info = pack.info();
  const size_t floats = size_t{3} * info.num_nodes;
  const std::vector<std::vector<pal_contact>> all = scenes(0.5 * info.max_displacement);

  Simulation alone;
  if (!alone.init(pack)) return 2;
  std::vector<std::vector<pal_real>> known;
  for (const std::vector<pal_contact>& contacts : all) {
    std::vector<pal_contact_result> results(contacts.size());
    known.emplace_back(floats);
    if (alone.session.contact_frame(contacts, results) != PAL_STATUS_OK ||
        alone.session.visual_frame(known.back().data()) != PAL_STATUS_OK)
      return 2;
  }

  Simulation shared;
  if (!shared.init(pack)) return 2;
  std::atomic<bool> finished = false;
  std::atomic<int> visual_frames = 0;
  std::atomic<int> torn = 0;
  std::vector<std::atomic<int>> seen(all.size());
  const auto read = [&] {
    std::vector<pal_real> field(floats);
    for (; !finished; ++visual_frames) {
      if (shared.session.visual_frame(field.data()) != PAL_STATUS_OK) ++torn;
      size_t scene = 0;
      while (scene < known.size() &&
             std::memcmp(field.data(), known[scene].data(), floats * sizeof(pal_real)) != 0)
        ++scene;
      if (scene < known.size()) {
        ++seen[scene];
      } else {
        ++torn;
      }
    }
  };
  const int num_readers = two_readers ? 2 : 1;
  std::vector<std::jthread> readers;
  for (int reader = 0; reader < num_readers; ++reader) readers.emplace_back(read);
  bool answered = true;
  for (int frame = 0; frame < kHapticFrames; ++frame) {
    const std::vector<pal_contact>& contacts = all[static_cast<size_t>(frame) % all.size()];
    std::vector<pal_contact_result> results(contacts.size());
    answered = shared.session.contact_frame(contacts, results) == PAL_STATUS_OK && answered;
  }
  finished = true;
  readers.clear();
  int scenes_seen = 0;
  for (const std::atomic<int>& count : seen) scenes_seen += count > 0 ? 1 : 0;
  std::printf("%d haptic frames, %d visual frames, %d scenes seen, %d torn\n", kHapticFrames,
              visual_frames.load(), scenes_seen, torn.load());
  return answered && torn == 0 && scenes_seen > 1 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  return run(argv[1], argc > 2 && std::strcmp(argv[2], "two-readers") == 0);
}
