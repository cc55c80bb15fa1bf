// A bending organ: a bar nine times as long as thick, clamped at one end. Strains are small, but the far end
// rotates and shortens.
#include <fmt/core.h>

#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"

namespace palpate::hard {
namespace {

constexpr double kLength = 9;  // of unit thickness
constexpr int kMostRings = 3;
constexpr double kFollowed = 0.05;  // over the length

Model slender_bar() {
  test::BlockShape shape;
  shape.cells = {18, 2, 2};
  shape.size = {kLength, 1, 1};
  shape.law = kTissue;
  Model model = test::tetrahedral_block(shape);
  for (const int node : test::nodes_on_plane(model, 0, 0.0)) {
    for (int axis = 0; axis < 3; ++axis) model.fixed.push_back({node, axis, 0.0});
  }
  return model;
}

// Four sites on the upper side, from mid-length to near the end, pushed by up to `most`.
const Organ& bar_with_zones(double most, int rings) {
  return shared_organ(fmt::format("slender {} {}", most, rings), [&] {
    OrganSpec spec;
    spec.model = slender_bar();
    for (const int node : test::nodes_on_plane(spec.model, 2, 1.0)) {
      const Eigen::Vector3d& at = spec.model.positions[static_cast<size_t>(node)];
      const double along = std::abs(at.x() - std::round(at.x()));
      if (std::abs(at.y() - 0.5) < 0.1 && at.x() > 4.5 && at.x() < 8.5 && along < 0.1)
        spec.sites.push_back(node);
    }
    spec.max_displacement = most;
    spec.tip_radius = 0.55;
    spec.max_contacts = 1;
    spec.zone_rings = rings;
    spec.polynomial = false;
    spec.survey_samples = 8;
    return spec;
  });
}

// Its end and its middle pushed down, up, sideways and obliquely.
std::vector<std::vector<pal_contact>> bending_pushes(const Organ& organ, double size) {
  std::vector<std::vector<pal_contact>> pushes;
  for (const double x : {8.0, 5.0}) {
    const std::uint32_t site = organ.site_near({x, 0.5, 1});
    for (const Eigen::Vector3d& along : {Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0, 0, 1),
                                         Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0.6, -0.8)})
      pushes.push_back({push(site, size * along)});
  }
  return pushes;
}

// Zones of two rings, the default; the linear model; zones of fewer and of more rings.
std::vector<Answer> bent(double size, const Bar& bar) {
  const Organ& usual = bar_with_zones(size, 2);
  std::vector<std::vector<Answer>> sets;
  for (const std::vector<pal_contact>& contacts : bending_pushes(usual, size)) {
    const Truth truth = usual.solve(contacts, 16);
    std::vector<Answer>& answers = sets.emplace_back();
    answers.push_back(usual.ask(PAL_MODEL_AUTO, contacts, truth));
    answers.push_back(usual.ask(PAL_MODEL_LINEAR, contacts, truth));
    for (int rings = 1; rings <= kMostRings; ++rings) {
      answers.push_back(bar_with_zones(size, rings).ask(PAL_MODEL_ZONE, contacts, truth));
      answers.back().by += fmt::format(", {} ring{}", rings, rings > 1 ? "s" : "");
    }
  }
  return worst_of(sets, bar);
}

}  // namespace

Group slender_cases() {
  Group group{
      "slender",
      "An organ that bends",
      "A bar nine times as long as it is thick, clamped at one end, with sites along the far half of its "
      "upper side: its end and its middle pushed down, up, aside and askew, by parts of its length as far as "
      "its pack goes. Packs with zones of one to three rings, beside full solves in sixteen increments.",
      {}};
  const Bar bar = {0.02, 0.02};
  for (const double part : {0.03, 0.08, 0.2}) {
    const double size = part * kLength;
    group.cases.push_back(
        {"slender", fmt::format("bent_{:02.0f}", 100 * part),
         fmt::format("a bar bent by {:.0f} % of its length, {:.2g} times its thickness", 100 * part, size),
         bar, Expected::answer, "", [size, bar] { return bent(size, bar); }});
    group.cases.back().slow = part > kFollowed;
  }
  return group;
}

}  // namespace palpate::hard
