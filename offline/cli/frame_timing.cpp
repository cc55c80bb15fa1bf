#include "offline/cli/frame_timing.hpp"

#include <algorithm>
#include <numeric>
#include <random>

namespace palpate {
namespace {

// Contacts in the sampled ball, at sites that change every 50 frames as a tool that slides would make them.
std::vector<pal_contact> random_contacts(const OpenedPack& opened, bool new_site_each_frame) {
  const pal_pack_info info = opened.info();
  const std::uint32_t num_sites = std::max(info.num_sites, 1u);
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<pal_contact> contacts;
  std::uint32_t site = 0;
  for (int i = 0; i < 4096; ++i) {
    if (new_site_each_frame || i % 50 == 0) site = (site + 1) % num_sites;
    Eigen::Vector3d d;
    do {
      d = Eigen::Vector3d(unit(generator), unit(generator), unit(generator));
    } while (d.norm() > 1);
    d *= info.max_displacement;
    contacts.push_back({site, {d[0], d[1], d[2]}, 0, {}});
  }
  return contacts;
}

// A session in memory of its own.
class TimedSession {
 public:
  TimedSession(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts)
      : arena_(required_bytes(opened, config_of(opened, model, max_contacts))), results_(max_contacts) {
    require_ok(session_.init(opened.pack(), config_of(opened, model, max_contacts), arena_.bytes()),
               "session");
  }
  void haptic(std::span<const pal_contact> contacts) {
    require_ok(session_.contact_frame(contacts, {results_.data(), contacts.size()}), "frame");
  }
  // Tool 0 holds a site; a haptic frame of its pose, with the same answer as the contact frame.
  void hold(std::uint32_t site) { require_ok(session_.hold(0, pal_default_hold(site)), "hold"); }
  void tool(const pal_pose& pose) {
    pal_tool_result result = {};
    require_ok(session_.haptic_frame(0.001, {&pose, 1}, {&result, 1}), "frame");
  }
  void visual(pal_real* field) { require_ok(session_.visual_frame(field), "frame"); }

 private:
  static pal_session_config config_of(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts) {
    pal_session_config config = pal_default_session_config(opened.pack().get());
    config.model = model;
    config.max_contacts = max_contacts;
    config.max_tools = 1;
    return config;
  }
  static size_t required_bytes(const OpenedPack& opened, const pal_session_config& config) {
    size_t bytes = 0;
    require_ok(Session::required_bytes(opened.pack(), config, bytes), "session");
    return bytes;
  }

  AlignedBytes arena_;
  std::vector<pal_contact_result> results_;
  Session session_;
};

}  // namespace

std::vector<Timing> time_model(const OpenedPack& opened, pal_model model, int frames) {
  TimedSession session(opened, model, 1);
  const std::vector<pal_contact> staying = random_contacts(opened, false);
  const std::vector<pal_contact> moving = random_contacts(opened, true);
  const auto touch = [&](const std::vector<pal_contact>& contacts) {
    return [&](int frame) { session.haptic({&contacts[static_cast<size_t>(frame) % contacts.size()], 1}); };
  };
  std::vector<Timing> timings;
  timings.push_back(time_frames(model_name(model), "force + stiffness", frames, touch(staying)));
  TimedSession held(opened, model, 1);
  held.hold(staying.front().site);
  timings.push_back(time_frames(model_name(model), "the same through a tool", frames, [&](int frame) {
    const double* d = staying[static_cast<size_t>(frame) % staying.size()].displacement;
    held.tool({{d[0], d[1], d[2]}, {1, 0, 0, 0}});
  }));
  // At a single site nothing moves: the same row again would claim a new factor in each frame.
  if (opened.info().num_sites > 1)
    timings.push_back(time_frames(model_name(model), "force, new site each frame", frames, touch(moving)));
  session.haptic({&staying.front(), 1});
  std::vector<pal_real> field(size_t{3} * opened.info().num_nodes);
  timings.push_back(time_frames(model_name(model), "field of shown nodes", frames,
                                [&](int) { session.visual(field.data()); }));
  return timings;
}

std::vector<Timing> time_start(const std::filesystem::path& file) {
  constexpr int kTimes = 50;
  std::vector<Timing> timings;
  for (const pal_verify verify : {PAL_VERIFY_ONCE, PAL_VERIFY_NEVER}) {
    const char* stage = verify == PAL_VERIFY_ONCE ? "open, verify once" : "open, verify never";
    timings.push_back(time_frames("", stage, kTimes, [&](int) {
      Pack pack;
      require_ok(pack.open(file.c_str(), verify), file.string());
    }));
  }
  Pack pack;
  require_ok(pack.open(file.c_str()), file.string());
  const pal_session_config config = pal_default_session_config(pack.get());
  std::size_t bytes = 0;
  require_ok(Session::required_bytes(pack, config, bytes), file.string());
  AlignedBytes arena(bytes);
  timings.push_back(time_frames("", "session init", kTimes, [&](int) {
    Session session;
    require_ok(session.init(pack, config, arena.bytes()), file.string());
  }));
  return timings;
}

Timing time_scene(const OpenedPack& opened, int frames) {
  const pal_pack_info info = opened.info();
  const bool several = info.has_linear != 0;  // polynomials answer one contact alone
  const std::uint32_t count = several ? std::min(info.max_contacts, info.num_sites) : 1;
  TimedSession session(opened, PAL_MODEL_AUTO, count);
  // One set of different sites after the other, in any order, so that none is known from the frame before.
  std::vector<pal_contact> contacts = random_contacts(opened, true);
  std::vector<std::uint32_t> order(info.num_sites);
  std::iota(order.begin(), order.end(), 0u);
  std::mt19937 generator(2);
  for (size_t first = 0; first + count <= contacts.size(); first += count) {
    std::shuffle(order.begin(), order.end(), generator);
    for (size_t i = 0; i < count; ++i) contacts[first + i].site = order[i];
  }
  const size_t num_sets = contacts.size() / count;
  return time_frames("", "scene", frames, [&](int frame) {
    session.haptic({&contacts[static_cast<size_t>(frame) % num_sets * count], count});
  });
}

}  // namespace palpate
