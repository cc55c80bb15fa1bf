#include "offline/pipeline/motion_survey.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <utility>

#include "offline/precompute/solver_threads.hpp"

namespace palpate {
namespace {

constexpr double kFrame = 1e-3;  // s

std::uint32_t most_contacts(const std::vector<ContactTruth>& truths) {
  size_t most = 1;
  for (const ContactTruth& truth : truths) most = std::max(most, truth.contacts.size());
  return static_cast<std::uint32_t>(most);
}

bool is_measured(const ContactTruth& truth) {
  return truth.solved && truth.largest_displacement() > 0;
}

std::vector<std::uint32_t> all_sites(const OpenedPack& opened) {
  std::vector<std::uint32_t> sites(opened.info().num_sites);
  std::iota(sites.begin(), sites.end(), 0u);
  return sites;
}

// The last frame of a motion.
struct Arrival {
  MeasuredPush push;
  double largest_jump = 0;  // force unit
  std::uint32_t flags = 0;
};

// Returns the largest |f_n - 2 f_(n-1) + f_(n-2)| of any contact over three frames.
double second_difference(const std::vector<Eigen::Vector3d>& older,
                         const std::vector<Eigen::Vector3d>& previous,
                         const std::vector<Eigen::Vector3d>& current) {
  double largest = 0;
  for (size_t c = 0; c < current.size(); ++c)
    largest = std::max(largest, (current[c] - 2 * previous[c] + older[c]).norm());
  return largest;
}

std::vector<Eigen::Vector3d> forces_of(const std::vector<pal_contact_result>& results) {
  std::vector<Eigen::Vector3d> forces;
  forces.reserve(results.size());
  for (const pal_contact_result& result : results) forces.emplace_back(result.force);
  return forces;
}

// Moves the contacts of a truth from rest at the speed of `motion`, in a session of its own.
Arrival move_to(const OpenedPack& opened, const ContactTruth& truth, const Motion& motion,
                std::uint32_t max_contacts, double floor) {
  ModelUnitSession session(opened, PAL_MODEL_ZONE, max_contacts, 0);
  const std::vector<std::uint32_t> sites = all_sites(opened);
  const Eigen::VectorXd at_rest = session.visual_frame();
  const double step = motion.speed * kFrame / opened.info().metres_per_length_unit;
  const int frames = std::max(1, static_cast<int>(std::ceil(truth.largest_displacement() / step)));
  session.contact_frame(contacts_at(truth.contacts, sites, 0));
  std::vector<Eigen::Vector3d> older(truth.contacts.size(), Eigen::Vector3d::Zero());
  std::vector<Eigen::Vector3d> previous = older;
  std::vector<pal_contact_result> results;
  Arrival arrival;
  bool has_iterated = false;
  for (int frame = 1; frame <= frames; ++frame) {
    // All steps have the same length, except a shorter first step.
    const double part = 1 - (frames - frame) * step / truth.largest_displacement();
    results = session.contact_frame(contacts_at(truth.contacts, sites, part));
    std::vector<Eigen::Vector3d> current = forces_of(results);
    if (has_iterated && frame > 2)
      arrival.largest_jump = std::max(arrival.largest_jump, second_difference(older, previous, current));
    older = std::exchange(previous, std::move(current));
    // A frame that takes the result of an iteration posts the next request: an iteration every `lag` frames
    // has this lag. The first iteration answers the frame at rest.
    has_iterated = frame % motion.lag == 0 && frame < frames;
    if (has_iterated) session.refine();
  }
  const MethodAnswer answer = answer_of(results, session.visual_frame() - at_rest);
  arrival.push = measure_push(truth, answer, floor);
  arrival.flags = answer.flags;
  return arrival;
}

}  // namespace

std::vector<MotionErrors> survey_motions(const OpenedPack& opened, const std::vector<ContactTruth>& truths,
                                         const std::vector<Motion>& motions, int jobs,
                                         const std::function<void(int, int)>& progress) {
  const std::uint32_t contacts = most_contacts(truths);
  const double floor = kForceFloor * largest_force(truths);
  std::vector<Arrival> arrivals(truths.size() * motions.size());
  const auto move = [&](size_t, size_t i) {
    const ContactTruth& truth = truths[i / motions.size()];
    if (is_measured(truth))
      arrivals[i] = move_to(opened, truth, motions[i % motions.size()], contacts, floor);
  };
  for_each_on_threads(arrivals.size(), jobs, move, progress);
  std::vector<MotionErrors> rows;
  for (size_t m = 0; m < motions.size(); ++m) {
    MotionErrors& row = rows.emplace_back();
    row.motion = motions[m];
    row.contacts = contacts;
    std::vector<double> displacements;
    std::vector<double> forces;
    for (size_t t = 0; t < truths.size(); ++t) {
      if (!is_measured(truths[t])) continue;
      const Arrival& arrival = arrivals[t * motions.size() + m];
      ++row.frames;
      row.flagged += (arrival.flags & PAL_FLAGS_UNRELIABLE) != 0 ? 1 : 0;
      displacements.push_back(arrival.push.displacement_error);
      forces.push_back(arrival.push.force_error);
      double largest = floor;
      for (const Eigen::Vector3d& force : truths[t].forces) largest = std::max(largest, force.norm());
      row.largest_jump = std::max(row.largest_jump, arrival.largest_jump / largest);
    }
    row.displacement = figures_of(displacements);
    row.force = figures_of(forces);
  }
  return rows;
}

int measure_lag(const OpenedPack& opened, const ContactTruth& truth) {
  using Clock = std::chrono::steady_clock;
  constexpr int kIterations = 8;
  ModelUnitSession session(opened, PAL_MODEL_ZONE, static_cast<std::uint32_t>(truth.contacts.size()), 0);
  const std::vector<std::uint32_t> sites = all_sites(opened);
  double longest = 0;
  for (int i = 0; i <= kIterations; ++i) {
    session.contact_frame(contacts_at(truth.contacts, sites, static_cast<double>(i) / kIterations));
    const Clock::time_point start = Clock::now();
    session.refine();
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (i > 0) longest = std::max(longest, seconds);  // the first call prepares the exterior
  }
  return 1 + static_cast<int>(std::ceil(longest / kFrame));
}

}  // namespace palpate
