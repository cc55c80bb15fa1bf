#include "offline/study/reference_methods.hpp"

#include <fmt/core.h>

#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

#include "offline/output/progress_bar.hpp"
#include "offline/study/held_organ.hpp"
#include "offline/study/method_timing.hpp"
#include "offline/study/timed_contacts.hpp"

namespace palpate {
namespace {

std::vector<LinearContact> at_rest(const std::vector<size_t>& sites) {
  std::vector<LinearContact> contacts;
  for (const size_t site : sites) contacts.push_back({site, Eigen::Vector3d::Zero()});
  return contacts;
}

std::vector<size_t> sites_of(const ContactTruth& truth) {
  std::vector<size_t> sites;
  for (const LinearContact& contact : truth.contacts) sites.push_back(contact.site);
  return sites;
}

// The position of a push among levels.
struct PushPlace {
  size_t level;
  size_t push;
};

// By method, level and push. Pushes with the same contacts share the preparation.
using HeldPushes = std::vector<std::vector<std::vector<MeasuredPush>>>;

HeldPushes measure_held(const Organ& organ, std::vector<HeldMethod>& methods,
                        const std::vector<Level>& levels, std::vector<std::string>& notes) {
  std::map<std::vector<size_t>, std::vector<PushPlace>> by_sites;
  HeldPushes measured(methods.size());
  std::vector<double> floors;
  for (size_t l = 0; l < levels.size(); ++l) {
    const std::vector<ContactTruth>& truths = levels[l].truths.truths;
    floors.push_back(kForceFloor * largest_force(truths));
    for (auto& of_method : measured) of_method.emplace_back(truths.size());
    for (size_t i = 0; i < truths.size(); ++i) {
      if (truths[i].solved) by_sites[sites_of(truths[i])].push_back({l, i});
    }
  }
  ProgressBar bar("linear methods", static_cast<int>(by_sites.size()));
  int done = 0;
  for (const auto& [sites, pushes] : by_sites) {
    HeldOrgan held(organ, sites);
    if (!held.has_whole_nodes() && std::erase_if(methods, [](const HeldMethod& one) {
                                     return one.kind == MethodKind::localized_cg;
                                   }) > 0) {
      notes.emplace_back(
          "Some nodes are fixed along one axis alone; LCG, which goes node by node, is not compared.");
      measured.resize(methods.size());
    }
    for (const auto& [level, push] : pushes) {
      const ContactTruth& truth = levels[level].truths.truths[push];
      for (size_t m = 0; m < methods.size(); ++m)
        measured[m][level][push] =
            measure_push(truth, held.answer(methods[m], truth.contacts), floors[level]);
    }
    bar.show(++done);
  }
  return measured;
}

// Returns contacts on the path at `part` of the largest |d|, all with the same displacement.
std::vector<LinearContact> around(const Organ& organ, const std::vector<size_t>& sites, double part,
                                  int frame) {
  const pal_contact contact = on_path(0, part * organ.scene.max_displacement, frame);
  std::vector<LinearContact> contacts = at_rest(sites);
  for (LinearContact& one : contacts) one.displacement = Eigen::Vector3d(contact.displacement);
  return contacts;
}

struct HeldTimes {
  TimeSummary haptic, haptic_cold;
  std::optional<TimeSummary> visual, visual_cold;  // empty: the haptic frame has computed the field
};

HeldTimes time_held(HeldOrgan& held, const HeldMethod& method, const Organ& organ,
                    const std::vector<size_t>& sites, const ReportEffort& effort) {
  const auto at = [&](int frame) {
    Eigen::VectorXd d(3 * static_cast<Eigen::Index>(sites.size()));
    const pal_contact contact = on_path(0, organ.scene.max_displacement, frame);
    for (Eigen::Index i = 0; i < d.size(); ++i) d[i] = contact.displacement[i % 3];
    return d;
  };
  CacheEvictor caches;
  int frame = 0;
  Eigen::VectorXd d;
  const auto haptic = [&](int) { held.haptic(method, d = at(frame++)); };
  const auto visual = [&](int) { held.visual(method, d); };
  HeldTimes times;
  times.haptic = time_calls(effort.reference_frames, haptic);
  times.haptic_cold = time_calls(effort.cold_frames_of_settings, haptic, &caches);
  if (method.kind == MethodKind::fixed_tensor) {
    times.visual = time_calls(effort.reference_frames, visual);
    times.visual_cold = time_calls(effort.cold_frames_of_settings, visual, &caches);
  }
  return times;
}

}  // namespace

NewtonFrames::NewtonFrames(const Organ& organ, const std::vector<size_t>& sites)
    : organ_(&organ),
      solver_(organ.assembly),
      load_(held_patches(organ.model, organ.sites, organ.rest, at_rest(sites))),
      u_(organ.rest.displacement_of(organ.model)) {}

void NewtonFrames::frame(const std::vector<LinearContact>& contacts) {
  const LoadCase next = held_patches(organ_->model, organ_->sites, organ_->rest, contacts);
  Eigen::VectorXd guess = u_;
  for (const LinearContact& contact : contacts) {
    for (const int node : organ_->sites.sites[contact.site].patch_nodes)
      guess.segment<3>(3 * node) = next.displacement.segment<3>(3 * node);
  }
  if (solver_.correct(next, guess, SolverSettings()).converged) {
    u_ = guess;
  } else if (!solver_.ramp(load_, next, u_, SolverSettings()).converged) {
    throw std::runtime_error("Newton's method finds no equilibrium on the path of its frames");
  }
  load_ = next;
}

void compare_references(const Organ& organ, const ReportEffort& effort, const std::vector<Level>& levels,
                        int contacts, ReportRows& rows) {
  std::vector<HeldMethod> methods = held_methods(effort.cg_tolerances);
  const HeldPushes measured = measure_held(organ, methods, levels, rows.report().notes);
  const std::vector<size_t> sites = sites_of(levels.back().truths.truths.front());
  {
    HeldOrgan held(organ, sites);
    for (size_t m = 0; m < methods.size(); ++m) {
      const HeldTimes times = time_held(held, methods[m], organ, sites, effort);
      for (size_t l = 0; l < levels.size(); ++l) {
        MethodRow& row = rows.report().methods[rows.add_method({methods[m].kind, methods[m].name}, contacts,
                                                               levels[l].truths, measured[m][l])];
        row.haptic = times.haptic;
        row.haptic_cold = times.haptic_cold;
        if (times.visual) row.visual = *times.visual;
        row.visual_cold = times.visual_cold;
      }
    }
  }
  ProgressBar bar("full Newton", static_cast<int>(levels.size()));
  int done = 0;
  for (const Level& level : levels) {
    const double part = level.truths.part;
    NewtonFrames newton(organ, sites);
    MethodRow exact;
    exact.kind = MethodKind::newton;
    exact.name = "full Newton, warm";
    exact.contacts = contacts;
    exact.part = part;
    try {
      exact.haptic = time_calls(effort.newton_frames,
                                [&](int frame) { newton.frame(around(organ, sites, part, frame)); });
      rows.report().methods.push_back(exact);
    } catch (const std::runtime_error& error) {
      rows.report().notes.push_back(
          fmt::format("Full Newton is not timed for {} contacts: {}.", contacts, error.what()));
    }
    bar.show(++done);
  }
}

}  // namespace palpate
