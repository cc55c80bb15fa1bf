// Models far from the origin and in odd units are the same organ.
#include <fmt/core.h>

#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"

namespace palpate::hard {
namespace {

constexpr double kPushDepth = 0.15;

OrganSpec changed(double length, double modulus, const Eigen::Vector3d& away) {
  OrganSpec spec =
      touched(unit_block(4, CompressibleNeoHookean{modulus * kTissue.mu, modulus * kTissue.lambda}),
              kPushDepth, 0.26);
  spec.sites.resize(4);
  for (Eigen::Vector3d& position : spec.model.positions) position = length * (position + away);
  spec.max_displacement *= length;
  spec.tip_radius *= length;
  return spec;
}

// Compared with its own full solve, and with the unit block's full solve in scaled numbers.
std::vector<Answer> in_units(double length, double modulus, const Eigen::Vector3d& away, const Bar& bar) {
  const Organ& plain = shared_organ("plain", [] { return changed(1, 1, Eigen::Vector3d::Zero()); });
  const Organ& organ = shared_organ(fmt::format("units {} {} {}", length, modulus, away.norm()),
                                    [&] { return changed(length, modulus, away); });
  const std::uint32_t site = 1;
  std::vector<Answer> answers = pushed_four_ways(organ, site, length * kPushDepth, bar);
  std::vector<std::vector<Answer>> beside;
  for (const Eigen::Vector3d& d : four_ways(kPushDepth)) {
    Truth truth = plain.solve({push(site, d)});
    truth.field *= length;
    for (Eigen::Vector3d& force : truth.forces) force *= modulus * length * length;
    beside.push_back({organ.ask(PAL_MODEL_AUTO, {push(site, length * d)}, truth)});
  }
  answers.push_back(worst_of(beside, bar).front());
  answers.back().by = "beside the unit block";
  return answers;
}

}  // namespace

Group unit_cases() {
  Group group{"unit",
              "Far from the origin, and in odd units",
              "A unit block, scaled and moved: beside full solves of the same numbers, and beside those of "
              "the unit block. A block 1e9 edges "
              "away has seven digits left of its shape.",
              {}};
  const Bar bar = {0.01, 0.01};
  const auto add = [&](const std::string& name, const std::string& hard, double length, double modulus,
                       double away) {
    group.cases.push_back({"unit", name, hard, bar, Expected::answer, "", [=] {
                             return in_units(length, modulus, away * Eigen::Vector3d(1, -0.7, 0.4), bar);
                           }});
  };
  add("nanometres", "lengths of 1e-9", 1e-9, 1, 0);
  add("gigametres", "lengths of 1e9", 1e9, 1, 0);
  add("soft", "moduli of 1e-12", 1, 1e-12, 0);
  add("stiff", "moduli of 1e12", 1, 1e12, 0);
  add("small_and_stiff", "lengths of 1e-9, moduli of 1e12", 1e-9, 1e12, 0);
  add("large_and_soft", "lengths of 1e9, moduli of 1e-12", 1e9, 1e-12, 0);
  add("far_1e3", "1e3 sides from the origin", 1, 1, 1e3);
  add("far_1e6", "1e6 sides from the origin", 1, 1, 1e6);
  add("far_1e9", "1e9 sides from the origin", 1, 1, 1e9);
  return group;
}

}  // namespace palpate::hard
