// Measures speed and error of Bullet's deformable body, a peer that Debian packages, at the pushes of a
// report. The body has the scene's mesh and small-strain moduli.
//
//   palpate_study_bullet SCENE.toml OUT.csv [SEED]     writes OUT.csv, for accuracy_tables.py
//
// Pushes are the first pushes of each |d| in the report of this scene and seed. The tool comes straight from
// rest in 50 frames, each timed alone: the first row. Then the body settles: the second row. A push without a
// finite, settled answer counts as diverged, with the error of a zero answer.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bench/speed_error/bullet_body.hpp"
#include "offline/fem/blas_kernels.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/output/progress_bar.hpp"
#include "offline/pipeline/scene_sites.hpp"
#include "offline/study/method_timing.hpp"
#include "offline/study/report_effort.hpp"
#include "offline/study/report_rows.hpp"

namespace palpate::study {
namespace {

constexpr int kFramesOfAnApproach = 50;
constexpr int kMostFramesToSettle = 150;
constexpr double kSettledMotion = 1e-4;    // largest motion of a node in a frame of a settled body, over |d|
constexpr double kSettledResidual = 0.05;  // largest BulletBody::imbalance() of a settled body
constexpr int kElementPushes = 60000;      // elements times pushes of a |d|, which bounds the time
constexpr int kMostPushes = 24;
constexpr int kPushesOfSeveral = 2;  // at each |d|
constexpr double kPartOfSeveral = 0.5;

struct PushAnswers {
  MethodAnswer arrived;              // at the end of the approach
  MethodAnswer settled;              // after settling
  bool diverged_on_the_way = false;  // in the approach
  bool diverged = false;             // not settled
  double imbalance = 0;
  double smallest_jacobian = 1;
  int frames_to_settle = 0;
  std::vector<double> nanoseconds;  // of the frames of the approach
};

// Returns Bullet's response in the form of a report.
MethodAnswer answer_of(const BulletBody& body, const Organ& organ,
                       const std::vector<LinearContact>& contacts) {
  MethodAnswer answer;
  answer.field = packed_rows(organ.sites, body.displacement());
  const Eigen::VectorXd force = body.internal_force();
  for (const LinearContact& contact : contacts) {
    Eigen::Vector3d& of_contact = answer.forces.emplace_back(Eigen::Vector3d::Zero());
    for (const int node : organ.sites.sites[contact.site].patch_nodes)
      of_contact += force.segment<3>(3 * node);
  }
  return answer;
}

// Returns the zero response, which stands for a diverged push.
MethodAnswer no_answer(const Organ& organ, size_t contacts) {
  MethodAnswer answer;
  answer.field.setZero(3 * static_cast<Eigen::Index>(organ.sites.packed_nodes.size()));
  answer.forces.assign(contacts, Eigen::Vector3d::Zero());
  return answer;
}

int pushes_of(const Model& model) {
  return std::clamp(kElementPushes / static_cast<int>(model.elements.size()), 1, kMostPushes);
}

double largest_step(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return (a - b).reshaped(3, a.size() / 3).colwise().norm().maxCoeff();
}

// Moves the contacts from rest and lets the body settle. `size`: the largest |d| of the contacts.
PushAnswers push(const Organ& organ, const std::vector<LinearContact>& contacts, double size) {
  const LoadCase load = held_patches(organ.model, organ.sites, organ.rest, contacts);
  BulletBody body(organ.model, load.held);
  PushAnswers answers;
  for (int frame = 1; frame <= kFramesOfAnApproach; ++frame) {
    const Eigen::VectorXd target = static_cast<double>(frame) / kFramesOfAnApproach * load.displacement;
    const auto start = std::chrono::steady_clock::now();
    body.frame(target);
    answers.nanoseconds.push_back(
        std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
  }
  Eigen::VectorXd before = body.displacement();
  answers.diverged_on_the_way = !before.allFinite();
  answers.arrived =
      answers.diverged_on_the_way ? no_answer(organ, contacts.size()) : answer_of(body, organ, contacts);
  bool has_settled = false;
  while (before.allFinite() && !has_settled && answers.frames_to_settle < kMostFramesToSettle) {
    body.frame(load.displacement);
    ++answers.frames_to_settle;
    const Eigen::VectorXd after = body.displacement();
    has_settled = largest_step(after, before) <= kSettledMotion * size;
    before = after;
  }
  answers.imbalance = body.imbalance();
  answers.diverged = !has_settled || !(answers.imbalance <= kSettledResidual);
  answers.settled = answers.diverged ? no_answer(organ, contacts.size()) : answer_of(body, organ, contacts);
  answers.smallest_jacobian = body.smallest_jacobian();
  return answers;
}

// A row of OUT.csv.
struct BulletRow {
  MethodRow method;
  int diverged = 0;  // pushes among method.pushes
};

// Counts over all pushes of a run.
struct RunCounts {
  int pushes = 0;
  int diverged = 0;
  // The following members cover the settled pushes.
  std::vector<int> frames_to_settle;
  double imbalance = 0;  // largest residual
  int inverted = 0;      // pushes with inverted elements
};

// Returns two rows of a level: at arrival, and after settling. Adds to `counts`.
std::vector<BulletRow> rows_of(const Organ& organ, const LevelTruths& level, int contacts, RunCounts& counts,
                               const std::function<void()>& progress) {
  std::vector<MeasuredPush> arrived;
  std::vector<MeasuredPush> settled;
  std::vector<double> nanoseconds;
  std::vector<double> medians;
  int diverged_on_the_way = 0;
  int diverged = 0;
  const double floor = kForceFloor * largest_force(level.truths);
  for (const ContactTruth& truth : level.truths) {
    progress();
    MeasuredPush& first = arrived.emplace_back();
    MeasuredPush& second = settled.emplace_back();
    if (!truth.solved) continue;
    const PushAnswers answers = push(organ, truth.contacts, truth.largest_displacement());
    first = measure_push(truth, answers.arrived, floor);
    second = measure_push(truth, answers.settled, floor);
    std::vector<double> push_times = answers.nanoseconds;
    nanoseconds.insert(nanoseconds.end(), push_times.begin(), push_times.end());
    medians.push_back(quantile(std::move(push_times), 0.5));
    diverged_on_the_way += answers.diverged_on_the_way ? 1 : 0;
    diverged += answers.diverged ? 1 : 0;
    ++counts.pushes;
    if (answers.diverged) continue;
    counts.frames_to_settle.push_back(answers.frames_to_settle);
    counts.imbalance = std::max(counts.imbalance, answers.imbalance);
    counts.inverted += answers.smallest_jacobian <= 0 ? 1 : 0;
  }
  counts.diverged += diverged;
  if (nanoseconds.empty()) return {};
  const std::string name = "Bullet " + BulletBody::version();
  std::vector<BulletRow> rows = {
      {method_row(name + ", as it moves", contacts, level, arrived), diverged_on_the_way},
      {method_row(name + ", settled", contacts, level, settled), diverged}};
  for (BulletRow& row : rows) row.method.haptic = summary_of(nanoseconds, medians);
  return rows;
}

std::vector<LevelTruths> solve(const Organ& organ, std::vector<LevelSets> levels, int pushes) {
  std::vector<LevelTruths> solved;
  for (LevelSets& level : levels) {
    level.sets.resize(std::min(level.sets.size(), static_cast<size_t>(pushes)));
    solved.push_back(
        {level.part, solve_contact_sets(organ.assembly, organ.sites, level.sets, 1, organ.rest)});
  }
  return solved;
}

// Errors are fractions, not percent; times are microseconds.
std::string csv_of(const std::vector<BulletRow>& rows) {
  std::string text =
      "method,contacts,part_of_max,pushes,diverged,displacement_p95,displacement_max,force_p95,force_max,"
      "haptic_median_us,haptic_p999_us,haptic_max_us\n";
  for (const auto& [row, diverged] : rows) {
    text +=
        fmt::format("\"{}\",{},{:g},{},{},{:.9g},{:.9g},{:.9g},{:.9g},{:.4g},{:.4g},{:.4g}\n", row.name,
                    row.contacts, row.part, row.pushes, diverged, row.displacement.p95, row.displacement.max,
                    row.force.p95, row.force.max, row.haptic.median, row.haptic.p999, row.haptic.max);
  }
  return text;
}

std::string summary(const RunCounts& counts, const std::string& pushes) {
  std::string settling = "never settled";
  if (!counts.frames_to_settle.empty()) {
    const auto [least, most] =
        std::minmax_element(counts.frames_to_settle.begin(), counts.frames_to_settle.end());
    settling = fmt::format(
        "settled, {} to {} frames later, when no node moves by more than {:g} % of |d| in a frame and forces "
        "are "
        "out of balance by {:.1g} % at most, so that what is left is its law",
        *least, *most, 100 * kSettledMotion, 100 * counts.imbalance);
  }
  return fmt::format(
      "Bullet {}: its deformable body on the same mesh, a step of backward Euler in each frame, which "
      "makes the field "
      "too, in single precision, with its own stable neo-Hookean law of the same moduli at small strain; as "
      "the tool "
      "arrives from rest in {} frames, and {}. Over {}: of {} pushes {} diverged, and {} settled with "
      "elements turned "
      "inside out.",
      BulletBody::version(), kFramesOfAnApproach, settling, pushes, counts.pushes, counts.diverged,
      counts.inverted);
}

std::int64_t seed_of(std::string_view text) {
  std::int64_t seed = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (error != std::errc() || end != text.data() + text.size() || seed < 0)
    throw std::invalid_argument(fmt::format("SEED is a number from 0 on, not '{}'", text));
  return seed;
}

void study(const std::filesystem::path& scene, const std::filesystem::path& out, std::int64_t seed) {
  check_can_finish(out);
  const ReportEffort effort;  // of the whole report, whose pushes are taken
  const Organ organ(with_at_most_sites(read_scene(scene), effort.scene_sites));
  if (!organ.rest.is_mesh())
    throw std::runtime_error(scene.string() + ": under [gravity], which Bullet is not compared at");
  const SiteDomain domain = [&](size_t site) -> Eigen::Matrix3d {
    return organ.scene.max_displacement * organ.sites.sites[site].frame;
  };
  const std::vector<double> parts = compared_parts(organ);
  const std::vector<size_t> sites =
      spread_sites(organ.model, organ.sites, static_cast<size_t>(effort.most_sites));
  const int contacts = std::min({3, organ.scene.max_contacts, static_cast<int>(organ.sites.sites.size())});
  const std::vector<LevelTruths> levels = solve(
      organ, draw_levels(organ, domain, parts, sites, effort.pushes_at_level, seed), pushes_of(organ.model));
  std::vector<LevelSets> several;
  if (contacts > 1) several = draw_several(organ, domain, parts, contacts, effort.several, seed);
  std::erase_if(several, [](const LevelSets& level) { return level.part != kPartOfSeveral; });
  const std::vector<LevelTruths> levels_of_several = solve(organ, several, kPushesOfSeveral);

  std::vector<BulletRow> rows;
  size_t pushes = 0;
  for (const auto* level_list : {&levels, &levels_of_several}) {
    for (const LevelTruths& level : *level_list) pushes += level.truths.size();
  }
  RunCounts counts;
  {
    ProgressBar bar("Bullet", static_cast<int>(pushes));
    int done = 0;
    const auto add = [&](const LevelTruths& level, int of_contacts) {
      for (BulletRow& row : rows_of(organ, level, of_contacts, counts, [&] { bar.show(done++); }))
        rows.push_back(std::move(row));
    };
    for (const LevelTruths& level : levels) add(level, 1);
    for (const LevelTruths& level : levels_of_several) add(level, contacts);
  }
  write_finished_text(out, csv_of(rows));
  std::string which = fmt::format("the first {} pushes of each |d| (seed {})", pushes_of(organ.model), seed);
  if (!levels_of_several.empty())
    which += fmt::format(" and the first {} of {} contacts", kPushesOfSeveral, contacts);
  fmt::print("{}\n", summary(counts, which));
}

}  // namespace
}  // namespace palpate::study

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
  try {
    if (argc != 3 && argc != 4)
      throw std::invalid_argument("usage: palpate_study_bullet SCENE.toml OUT.csv [SEED]");
    palpate::study::study(argv[1], argv[2], argc == 4 ? palpate::study::seed_of(argv[3]) : 1);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
