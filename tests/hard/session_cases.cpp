// What tools do to a session: jumps across the whole domain in one frame, places outside of it, numbers that are
// none, swipes from site to site.
#include <fmt/core.h>

#include <random>

#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"
#include "tests/hard/hard_motions.hpp"

namespace palpate::hard {
namespace {

constexpr double kMost = 0.15;

const Organ& organ() {
  return shared_organ("session", [] {
    OrganSpec spec = touched(unit_block(4), kMost, 0.26);
    spec.zone_rings = 2;
    return spec;
  });
}

std::uint32_t middle() {
  return organ().site_near({0.5, 0.5, 1});
}

// Contacts come and go at random over all sites for some hundred frames; then these are held. Beside a new session that
// came straight there.
std::vector<Answer> restless() {
  const std::vector<pal_contact> there = {push(0, {0.05, 0, -0.08}), push(8, {-0.06, 0.03, -0.05})};
  std::vector<Answer> answers;
  for (const pal_model model : {PAL_MODEL_AUTO, PAL_MODEL_LINEAR, PAL_MODEL_ZONE}) {
    ModelUnitSession fresh(organ().opened(), model, 3, 0);
    Truth truth{true, {}, {}};
    for (const pal_contact_result& result : fresh.settle(there)) truth.forces.emplace_back(result.force);
    truth.field = fresh.visual_frame();
    ModelUnitSession session(organ().opened(), model, 3, 0);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> component(-kMost, kMost);
    std::vector<pal_contact_result> results;
    bool is_finite = true;
    for (int frame = 0; frame < 400; ++frame) {
      std::vector<pal_contact> contacts(random() % 4);
      for (pal_contact& contact : contacts) {
        contact = push(static_cast<std::uint32_t>(random() % organ().num_sites()),
                       {component(random), component(random), component(random)});
      }
      for (const pal_contact_result& result : session.contact_frame(contacts))
        is_finite = is_finite && Eigen::Vector3d(result.force).allFinite();
    }
    for (int frame = 0; frame < kFramesToRest; ++frame) results = session.contact_frame(there);
    answers.push_back(organ().compare(asked_of(model), there, results, session.visual_frame(), truth));
    answers.back().finite = answers.back().finite && is_finite;
  }
  return answers;
}

// A tool through the haptic loop: far away, then not a number, then where it was. Nothing but finite forces, within
// the limit.
std::vector<Answer> wild_tool() {
  std::vector<Answer> answers;
  for (const pal_model model : {PAL_MODEL_AUTO, PAL_MODEL_LINEAR, PAL_MODEL_ZONE}) {
    pal_session_config config = pal_default_session_config(organ().opened().pack().get());
    config.model = model;
    config.max_tools = 1;
    config.max_force = 0.5;
    size_t bytes = 0;
    require_ok(Session::required_bytes(organ().opened().pack(), config, bytes), "session");
    AlignedBytes arena(bytes);
    Session session;
    require_ok(session.init(organ().opened().pack(), config, arena.bytes()), "session");
    require_ok(session.hold(0, pal_default_hold(middle())), "hold");
    Answer answer;
    answer.by = asked_of(model);
    double largest = 0;
    const double far[] = {0.05,
                          0.15,
                          -0.15,
                          3,
                          -1e3,
                          1e30,
                          1e200,
                          std::numeric_limits<double>::infinity(),
                          std::numeric_limits<double>::quiet_NaN(),
                          0.05};
    std::vector<std::string> flagged;
    for (const double z : far) {
      for (int frame = 0; frame < 10; ++frame) {
        const pal_pose pose = {{0, 0, -z}, {1, 0, 0, 0}};
        pal_tool_result result = {};
        require_ok(session.haptic_frame(0.001, {&pose, 1}, {&result, 1}), "frame");
        const Eigen::Vector3d force(result.force);
        answer.finite = answer.finite && force.allFinite() && Eigen::Vector3d(result.torque).allFinite();
        largest = std::max(largest, force.norm());
        const bool is_doubtful = std::abs(z) > kMost * 1.01 || std::isnan(z);
        if (is_doubtful && result.flags == 0) flagged.push_back(fmt::format("{}", z));
      }
    }
    answer.happened = fmt::format("largest force {:.3g}, the limit is 0.5; {} doubtful frames without a flag",
                                  largest, flagged.size());
    if (flagged.empty() && largest <= 0.5 * (1 + 1e-12)) answer.flags = {"each doubtful frame"};
    answers.push_back(answer);
  }
  return answers;
}

}  // namespace

Group session_cases() {
  Group group{"session",
              "Tools that do what no tool should",
              "One session on a block with nine sites. After a jump a zone goes on frame by frame and flags "
              "that it has not arrived; once "
              "there, it is where it would be from rest. Beyond the sampled domain every answer is flagged, "
              "and its error is what it is.",
              {}};
  const auto add = [&](const std::string& name, const std::string& hard, const Bar& bar, Expected expected,
                       auto run, const std::string& reason = "") {
    group.cases.push_back({"session", name, hard, bar, expected, reason, run});
  };
  const Bar bar = {0.02, 0.02};
  add("jump_across", "from one end of the domain to the other in one frame", bar, Expected::answer, [] {
    return jump(organ(), middle(), {{0, 0, kMost}, {0, 0, -kMost}});
  });
  add("jump_aside", "from one side of the domain to the other in one frame", bar, Expected::answer, [] {
    return jump(organ(), middle(), {{-kMost, 0, 0}, {kMost, 0, 0}});
  });
  add("jump_and_back", "ten jumps across the domain", bar, Expected::answer, [] {
    std::vector<Eigen::Vector3d> path;
    for (int i = 0; i < 10; ++i) path.push_back((i % 2 == 0 ? kMost : -kMost) * Eigen::Vector3d(0.6, 0, 0.8));
    return jump(organ(), middle(), path);
  });
  add("jump_outside", "four times out of the domain in one frame, and back in", bar, Expected::answer, [] {
    return jump(organ(), middle(), {{0, 0, -4 * kMost}, {0.05, 0, -0.1}});
  });
  add("jump_far_outside", "a million times out of the domain in one frame, and back in", bar,
      Expected::answer, [] {
        return jump(organ(), middle(), {{0, 0, -1e6 * kMost}, {0, 1e6 * kMost, 0}, {0.05, 0, -0.1}});
      });
  add("restless",
      "up to three contacts that change place in each of 400 frames, then two that rest: beside a new "
      "session",
      Bar{1e-3, 1e-3}, Expected::answer, [] { return restless(); });
  add("outside_1_5", "half as far again as the domain", bar, Expected::answer,
      [] { return outside(organ(), middle(), 1.5); });
  add(
      "outside_2", "twice as far as the domain", bar, Expected::limit,
      [] { return outside(organ(), middle(), 2); },
      "what was not sampled is continued; how wrong that is, is not known");
  add("outside_1e3", "a thousand times as far as the domain, where there is no equilibrium", bar,
      Expected::nothing, [] { return outside(organ(), middle(), 1e3); });
  add("outside_1e30", "1e30 times as far as the domain", bar, Expected::nothing,
      [] { return outside(organ(), middle(), 1e30); });
  add("not_a_number", "a displacement that is not a number", bar, Expected::nothing,
      [] { return not_finite(organ(), middle(), std::numeric_limits<double>::quiet_NaN()); });
  add("infinite", "an infinite displacement", bar, Expected::nothing,
      [] { return not_finite(organ(), middle(), std::numeric_limits<double>::infinity()); });
  add("wild_tool",
      "a tool through the haptic loop: out of the domain, to 1e200, infinite, not a number, back", bar,
      Expected::nothing, [] { return wild_tool(); });
  add("swipe", "a swipe over sites and between them", bar, Expected::answer, [] {
    return swipe(organ(), {0.26, 0.3, 1}, {0.74, 0.65, 1}, {0, 0, -0.5 * kMost});
  });
  return group;
}

}  // namespace palpate::hard
