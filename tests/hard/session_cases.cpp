// Tools against a session: jumps across the domain in one frame, places outside it, NaN, swipes from site to
// site.
#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"
#include "tests/hard/hard_motions.hpp"

namespace palpate::hard {
namespace {

constexpr double kMostOfSessions = 0.15;

const Organ& organ() {
  return shared_organ("session", [] {
    OrganSpec spec = touched(unit_block(4), kMostOfSessions, 0.26);
    spec.zone_rings = 2;
    return spec;
  });
}

// A domain of twice the depth.
const Organ& deep() {
  return shared_organ("deep", [] {
    OrganSpec spec = touched(unit_block(4), 2 * kMostOfSessions, 0.26);
    spec.zone_rings = 2;
    return spec;
  });
}

// Inwards by so many edges, then to one side and to the other, as far as the scene allows.
std::vector<Eigen::Vector3d> in_and_aside(const Organ& organ, std::uint32_t site, double edges) {
  const Eigen::Vector3d inward = organ.sites().sites[site].inward;
  const Eigen::Vector3d in = edges * organ.edge() * inward;
  const double most = 0.999 * organ.scene().max_displacement;
  const Eigen::Vector3d aside = std::sqrt(most * most - in.squaredNorm()) * inward.unitOrthogonal();
  return {in, in + aside, in - aside};
}

// Some sites of the shipped brain, zones of two rings, to two edges.
Organ brain_to_two_edges() {
  LoadedScene loaded =
      read_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "models" / "brain" / "brain_zone.toml");
  std::vector<int> sites;
  for (size_t i = 0; i < loaded.scene.sites.size(); i += loaded.scene.sites.size() / 4)
    sites.push_back(loaded.scene.sites[i]);
  loaded.scene.sites = sites;
  loaded.scene.max_displacement *= 2;
  loaded.scene.max_contacts = 1;
  return {loaded.model, loaded.scene};
}

std::vector<Answer> dragged_on_the_brain(double edges, double step) {
  const Organ organ = brain_to_two_edges();
  std::vector<std::vector<Answer>> sets;
  for (std::uint32_t site = 0; site < organ.num_sites(); ++site)
    sets.push_back(drag(organ, site, in_and_aside(organ, site, edges), step));
  return worst_of(sets, {0.02, 0.02});
}

// Inwards, outwards and sideways by four edges.
std::vector<Answer> four_edges_on_the_brain() {
  const Organ organ = brain_to_two_edges();
  std::vector<std::vector<Answer>> sets;
  for (std::uint32_t site = 0; site < organ.num_sites(); ++site) {
    const Eigen::Vector3d inward = organ.sites().sites[site].inward;
    for (const Eigen::Vector3d& along : {inward, Eigen::Vector3d(-inward), inward.unitOrthogonal()})
      sets.push_back(ask_all(organ, {push(site, 4 * organ.edge() * along)}));
  }
  return worst_of(sets, {0.02, 0.02});
}

std::uint32_t middle() {
  return organ().site_near({0.5, 0.5, 1});
}

// Contacts join and leave at random over all sites for hundreds of frames, then some stay. Compared with a
// new session that went straight there.
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
    std::uniform_real_distribution<double> component(-kMostOfSessions, kMostOfSessions);
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
    for (int frame = 0; frame < kFramesToRest; ++frame) {
      results = session.contact_frame(there);
      if (results.front().model == PAL_MODEL_ZONE) session.refine();
    }
    answers.push_back(organ().compare(asked_of(model), there, results, session.visual_frame(), truth));
    answers.back().finite = answers.back().finite && is_finite;
  }
  return answers;
}

// A tool in the haptic loop: far away, then NaN, then back. All forces must be finite and within the limit.
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
        const bool is_doubtful = std::abs(z) > kMostOfSessions * 1.01 || std::isnan(z);
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
    return jump(organ(), middle(), {{0, 0, kMostOfSessions}, {0, 0, -kMostOfSessions}});
  });
  add("jump_aside", "from one side of the domain to the other in one frame", bar, Expected::answer, [] {
    return jump(organ(), middle(), {{-kMostOfSessions, 0, 0}, {kMostOfSessions, 0, 0}});
  });
  add("jump_and_back", "ten jumps across the domain", bar, Expected::answer, [] {
    std::vector<Eigen::Vector3d> path(10, kMostOfSessions * Eigen::Vector3d(0.6, 0, 0.8));
    for (size_t i = 1; i < path.size(); i += 2) path[i] = -path[i];
    return jump(organ(), middle(), path);
  });
  add("jump_outside", "four times out of the domain in one frame, and back in", bar, Expected::answer, [] {
    return jump(organ(), middle(), {{0, 0, -4 * kMostOfSessions}, {0.05, 0, -0.1}});
  });
  add("jump_far_outside", "a million times out of the domain in one frame, and back in", bar,
      Expected::answer, [] {
        return jump(organ(), middle(),
                    {{0, 0, -1e6 * kMostOfSessions}, {0, 1e6 * kMostOfSessions, 0}, {0.05, 0, -0.1}});
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
    return swipe(organ(), {0.26, 0.3, 1}, {0.74, 0.65, 1}, {0, 0, -0.5 * kMostOfSessions});
  });
  for (const double step : {0.01, 0.1}) {
    group.cases.push_back(
        {"session", fmt::format("dragged_{:02.0f}", 100 * step),
         fmt::format("pressed in by nine tenths of an edge and dragged aside, {:g} edges a frame", step), bar,
         Expected::answer, "", [step] {
           const std::uint32_t site = deep().site_near({0.5, 0.5, 1});
           return drag(deep(), site, in_and_aside(deep(), site, 0.9), step);
         }});
    for (const double edges : {1.0, 1.8}) {
      group.cases.push_back(
          {"session", fmt::format("brain_dragged_{:02.0f}_{:02.0f}", 10 * edges, 100 * step),
           fmt::format(
               "the brain, two rings, to two edges: pressed in by {:g} edges and dragged aside, {:g} edges "
               "a frame",
               edges, step),
           bar, Expected::answer, "", [=] { return dragged_on_the_brain(edges, step); }, true});
    }
  }
  group.cases.push_back({"session", "brain_four_edges",
                         "the brain, two rings, to two edges: in, out and aside by four", bar,
                         Expected::answer, "", [] { return four_edges_on_the_brain(); }, true});
  return group;
}

}  // namespace palpate::hard
