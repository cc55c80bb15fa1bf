// affine_site: contacts at unsampled sites, answered by the series at rest after two confirming solves.
#include <fmt/core.h>

#include <limits>
#include <stdexcept>

#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"
#include "tests/hard/hard_motions.hpp"

namespace palpate::hard {
namespace {

constexpr double kMostUnsampled = 0.1;  // half an edge
constexpr double kTipRadius = 0.26;

OrganSpec fewest(Model model, double most, double target) {
  OrganSpec spec = touched(std::move(model), most, kTipRadius);
  spec.zone_rings = 2;
  spec.fewest = true;
  spec.target = target;
  return spec;
}

// The sampled or unsampled site nearest to a place.
std::uint32_t site_near(const Organ& organ, bool sampled, const Eigen::Vector3d& place) {
  std::uint32_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t site = 0; site < organ.num_sites(); ++site) {
    ModelUnitSession session(organ.opened(), PAL_MODEL_AUTO, 1, 0);
    const std::vector<pal_contact> tiny = {push(site, {0, 0, -1e-3 * organ.scene().max_displacement})};
    const bool is_sampled = session.settle(tiny).front().model == PAL_MODEL_POLYNOMIAL;
    const double away =
        (organ.model().positions[static_cast<size_t>(organ.sites().sites[site].node)] - place).norm();
    if (is_sampled != sampled || away >= least) continue;
    least = away;
    nearest = site;
  }
  if (std::isinf(least)) throw std::runtime_error(sampled ? "no site was sampled" : "every site was sampled");
  return nearest;
}

const Eigen::Vector3d kMiddle(0.5, 0.5, 1);

const Organ& tissue() {
  return shared_organ("unsampled", [] { return fewest(unit_block(5), kMostUnsampled, 0.01); });
}

// Pushes of one and a half edges; only some sites are sampled.
const Organ& mixture() {
  return shared_organ("mixture", [] { return fewest(unit_block(5), 0.3, 0.003); });
}

std::vector<Answer> pushed(const Organ& organ, const Bar& bar) {
  return pushed_four_ways(organ, site_near(organ, false, kMiddle), organ.scene().max_displacement, bar);
}

}  // namespace

Group unsampled_cases() {
  Group group{
      "unsampled",
      "Sites where nothing was sampled",
      "Blocks built with sampled = \"fewest\": where two solves at the places of largest doubt keep the "
      "target, a site carries its series at rest alone (affine_site), and no sample. Asked at such sites "
      "and between them and others; for a site without samples polynomial is affine.",
      {}};
  const auto add = [&](const std::string& name, const std::string& hard, Expected expected, auto run,
                       const std::string& reason = "") {
    group.cases.push_back({"unsampled", name, hard, {0.02, 0.02}, expected, reason, run});
  };
  const Bar bar = {0.02, 0.02};
  const Eigen::Vector3d across(0.6 * kMostUnsampled, 0, 0.8 * kMostUnsampled);
  add("to_the_edge", "pushed four ways to the edge of the domain", Expected::answer,
      [bar] { return pushed(tissue(), bar); });
  add("mixture_to_the_edge",
      "pushed four ways to the edge of the domain, where other sites had to be sampled", Expected::answer,
      [bar] { return pushed(mixture(), bar); });
  group.cases.back().slow = true;
  add("jump_across", "from one end of the domain to the other in one frame", Expected::answer, [across] {
    return jump(tissue(), site_near(tissue(), false, kMiddle), {across, -across});
  });
  add("jump_far_outside", "a million times out of the domain in one frame, and back in", Expected::answer,
      [across] {
        return jump(tissue(), site_near(tissue(), false, kMiddle),
                    {1e6 * across, -1e6 * across, -0.5 * across});
      });
  add("swipe", "a swipe over sites with samples, sites without, and between them", Expected::answer, [] {
    const Organ& organ = mixture();
    const auto place = [&](bool sampled) {
      const std::uint32_t site = site_near(organ, sampled, kMiddle);
      return organ.model().positions[static_cast<size_t>(organ.sites().sites[site].node)];
    };
    return swipe(organ, place(true), place(false), {0.03, 0, -0.06});
  });
  group.cases.back().slow = true;
  add("two_contacts", "two contacts at sites without samples, pushed in by a quarter of an edge",
      Expected::answer, [bar] {
        const Organ& organ = tissue();
        return ask_all(organ, {push(organ.site_near({0.2, 0.2, 1}), {0, 0, -0.5 * kMostUnsampled}),
                               push(organ.site_near({0.8, 0.8, 1}), {0, 0, -0.5 * kMostUnsampled})});
      });
  add("outside_1_5", "half as far again as the domain, at a site without samples", Expected::answer,
      [] { return outside(tissue(), site_near(tissue(), false, kMiddle), 1.5); });
  add(
      "outside_2", "twice as far as the domain, at a site without samples", Expected::limit,
      [] { return outside(tissue(), site_near(tissue(), false, kMiddle), 2); },
      "what was not sampled is continued; how wrong that is, is not known");
  add("outside_1e30", "1e30 times as far as the domain", Expected::nothing,
      [] { return outside(tissue(), site_near(tissue(), false, kMiddle), 1e30); });
  add("not_a_number", "a displacement that is not a number", Expected::nothing, [] {
    return not_finite(tissue(), site_near(tissue(), false, kMiddle),
                      std::numeric_limits<double>::quiet_NaN());
  });
  for (const auto& [flatness, shown] : {std::pair{1e-2, "1e2"}, {1e-3, "1e3"}, {1e-6, "1e6"}}) {
    add(fmt::format("slivers_{}", shown),
        fmt::format("27 slivers {} times flatter than the cells, pushed four ways to the edge of the domain",
                    shown),
        Expected::answer, [flatness = flatness, bar] {
          const Organ& organ = shared_organ(fmt::format("unsampled slivers {}", flatness), [&] {
            return fewest(test::with_fixed_base(test::block_with_slivers(flatness)), 0.08, 0.01);
          });
          return pushed(organ, bar);
        });
    group.cases.back().slow = flatness > 1e-5;
  }
  add("lambda_1e2", "lambda / mu = 1e2, pushed four ways to the edge of the domain", Expected::answer, [bar] {
    const Organ& organ = shared_organ("unsampled lambda 1e2", [] {
      return fewest(unit_block(5, CompressibleNeoHookean{1, 1e2}), 0.08, 0.01);
    });
    return pushed(organ, bar);
  });
  add("mean_dilatation", "C3D4 MEAN DILATATION, nu = 0.499, pushed four ways to the edge of the domain",
      Expected::answer, [bar] {
        const Organ& organ = shared_organ("unsampled mean dilatation", [] {
          return fewest(nearly_incompressible_block(4, test::Elements::c3d4_mean_dilatation,
                                                    test::neo_hooke_of(1, 0.499)),
                        0.08, 0.01);
        });
        return pushed(organ, bar);
      });
  return group;
}

}  // namespace palpate::hard
