// snapshot_threads PACK [two-readers | refine | two-refiners]: haptic frames on one thread, visual frames on another, under
// ThreadSanitizer. Every field that the reader sees must equal, to the bit, the field of some haptic frame.
// The header forbids two readers: with two-readers ThreadSanitizer must find the race (exit code 66), which
// proves the check. With refine a third thread refines zones: frames at rest must come to the answer of one thread.
// Two threads that refine are a race, too.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
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

  bool init(const palpate::Pack& pack, pal_model model = PAL_MODEL_AUTO) {
    pal_session_config config = pal_default_session_config(pack.get());
    config.model = model;
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
  readers.reserve(static_cast<size_t>(num_readers));
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

// Moves two contacts to and fro and holds them, calling `iterate` after each frame, until the estimated error is small.
template <typename Iterate>
std::vector<double> forces_at_rest(palpate::Session& session, double push, Iterate&& iterate) {
  constexpr int kMoving = 50;
  constexpr int kMostFrames = 50000;
  constexpr double kSmall = 1e-5;
  std::vector<pal_contact_result> results(2);
  bool is_small = false;
  for (int frame = 0; frame < kMostFrames && !(is_small && frame > kMoving); ++frame) {
    std::vector<pal_contact> contacts = scenes(push)[2];
    const double part = frame < kMoving ? 0.01 * (frame % 40) : 0.4;
    for (pal_contact& contact : contacts) {
      for (double& d : contact.displacement) d *= part;
    }
    if (session.contact_frame(contacts, results) != PAL_STATUS_OK) return {};
    is_small = results[0].displacement_error <= kSmall;
    iterate();
  }
  if (!is_small) return {};
  std::vector<double> forces;
  for (const pal_contact_result& result : results)
    forces.insert(forces.end(), result.force, result.force + 3);
  return forces;
}

int run_refining(const char* path, int num_refiners) {
  palpate::Pack pack;
  if (pack.open(path) != PAL_STATUS_OK) return 2;
  const double push = pack.info().max_displacement;
  Simulation alone;
  Simulation shared;
  if (!alone.init(pack, PAL_MODEL_ZONE) || !shared.init(pack, PAL_MODEL_ZONE)) return 2;
  bool refined = true;
  const std::vector<double> expected = forces_at_rest(
      alone.session, push, [&] { refined = alone.session.refine() == PAL_STATUS_OK && refined; });
  std::atomic<bool> finished = false;
  std::atomic<int> delivered = 0;
  std::vector<std::jthread> others;
  others.reserve(static_cast<size_t>(num_refiners) + 1);
  for (int refiner = 0; refiner < num_refiners; ++refiner) {
    others.emplace_back([&] {
      pal_refinement refinement = {};
      while (!finished) {
        if (shared.session.refine(20000, refinement) == PAL_STATUS_OK && refinement.delivered != 0)
          ++delivered;
        if (refinement.waiting == 0) std::this_thread::yield();
      }
    });
  }
  others.emplace_back([&] {
    std::vector<pal_real> field(size_t{3} * pack.info().num_nodes);
    while (!finished) {
      if (shared.session.visual_frame(field.data()) != PAL_STATUS_OK) return;
    }
  });
  const std::vector<double> found = forces_at_rest(
      shared.session, push, [] { std::this_thread::sleep_for(std::chrono::microseconds(100)); });
  finished = true;
  others.clear();
  double largest = 0;
  double error = expected.size() == 6 && found.size() == 6 ? 0 : 1;
  for (size_t i = 0; i < found.size() && error < 1; ++i) {
    largest = std::max(largest, std::abs(expected[i]));
    error = std::max(error, std::abs(found[i] - expected[i]));
  }
  std::printf("%d deliveries, error %g of %g\n", delivered.load(), error, largest);
  return refined && error <= 1e-5 * largest ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const auto is_mode = [&](const char* name) { return argc > 2 && std::strcmp(argv[2], name) == 0; };
  if (is_mode("refine") || is_mode("two-refiners")) return run_refining(argv[1], is_mode("refine") ? 1 : 2);
  return run(argv[1], is_mode("two-readers"));
}
