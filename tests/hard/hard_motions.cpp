#include "tests/hard/hard_motions.hpp"

#include <fmt/core.h>

#include <cmath>

#include "tests/hard/hard_bodies.hpp"

namespace palpate::hard {

std::vector<Answer> jump(const Organ& organ, std::uint32_t site, const std::vector<Eigen::Vector3d>& path) {
  const std::vector<pal_contact> there = {push(site, path.back())};
  const Truth truth = organ.solve(there);
  std::vector<Answer> answers;
  for (const pal_model model : models_for_one(organ)) {
    ModelUnitSession session(organ.opened(), model, 1, 0);
    std::vector<pal_contact_result> results;
    for (size_t i = 0; i + 1 < path.size(); ++i) {
      for (int frame = 0; frame < kFramesToRest; ++frame)
        results = session.contact_frame(std::vector<pal_contact>{push(site, path[i])});
    }
    results = session.contact_frame(there);
    Answer first =
        organ.compare(asked_of(model) + ", frame of the jump", there, results, session.visual_frame(), truth);
    for (int frame = 0; frame < kFramesToRest; ++frame) results = session.contact_frame(there);
    answers.push_back(organ.compare(asked_of(model), there, results, session.visual_frame(), truth));
    if (model == PAL_MODEL_ZONE) answers.push_back(first);
  }
  return answers;
}

std::vector<Answer> outside(const Organ& organ, std::uint32_t site, double times) {
  std::vector<std::vector<Answer>> sets;
  for (const Eigen::Vector3d& d : four_ways(times * organ.scene().max_displacement)) {
    const std::vector<pal_contact> contacts = {push(site, d)};
    Truth truth;
    if (times < 3) truth = organ.solve(contacts);
    std::vector<Answer> answers;
    for (const pal_model model : models_for_one(organ)) answers.push_back(organ.ask(model, contacts, truth));
    sets.push_back(answers);
  }
  return worst_of(sets, {0.02, 0.02});
}

std::vector<Answer> not_finite(const Organ& organ, std::uint32_t site, double component) {
  std::vector<Answer> answers;
  for (const pal_model model : models_for_one(organ))
    answers.push_back(organ.ask(model, {push(site, {0, component, -0.05})}, {}));
  return answers;
}

std::vector<Answer> swipe(const Organ& organ, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                          const Eigen::Vector3d& d) {
  std::vector<Truth> truths;
  for (std::uint32_t site = 0; site < organ.num_sites(); ++site)
    truths.push_back(organ.solve({push(site, d)}));
  std::vector<Answer> answers;
  for (const pal_model model : models_for_one(organ)) {
    ModelUnitSession session(organ.opened(), model, 1, 0);
    std::vector<std::vector<Answer>> frames;
    double largest_jump = 0;
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    constexpr int kFrames = 100;
    for (int frame = 0; frame <= kFrames; ++frame) {
      const Eigen::Vector3d place = from + static_cast<double>(frame) / kFrames * (to - from);
      pal_surface_point point;
      require_ok(pal_pack_find_surface_point(organ.opened().pack().get(), place.data(), &point), "surface");
      const std::vector<pal_contact> contacts = {pal_contact_at(&point, d.data())};
      std::vector<pal_contact_result> results;
      for (int again = 0; again < 4; ++again) results = session.contact_frame(contacts);
      Truth truth;
      truth.solved = true;
      truth.forces = {Eigen::Vector3d::Zero()};
      truth.field = Eigen::VectorXd::Zero(truths.front().field.size());
      for (int corner = 0; corner < 3; ++corner) {
        if (!(point.weights[corner] > 0)) continue;
        truth.forces[0] += point.weights[corner] * truths[point.sites[corner]].forces[0];
        truth.field += point.weights[corner] * truths[point.sites[corner]].field;
      }
      frames.push_back({organ.compare(asked_of(model), contacts, results, session.visual_frame(), truth)});
      const Eigen::Vector3d force(results[0].force);
      if (frame > 0) largest_jump = std::max(largest_jump, (force - before).norm() / force.norm());
      before = force;
    }
    answers.push_back(worst_of(frames, {0.02, 0.02}).front());
    answers.back().happened +=
        fmt::format("; the force changes by up to {:.2g} % a frame", 100 * largest_jump);
  }
  return answers;
}

std::vector<Answer> drag(const Organ& organ, std::uint32_t site, const std::vector<Eigen::Vector3d>& way,
                         double step) {
  std::vector<Eigen::Vector3d> frames;
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& to : way) {
    const int count = static_cast<int>(std::ceil((to - from).norm() / (step * organ.edge())));
    for (int i = 1; i <= count; ++i) frames.emplace_back(from + (to - from) * i / count);
    from = to;
  }
  constexpr size_t kCompared = 10;
  constexpr size_t kLag = 5;  // frames from an iteration of the refining lane to the next
  std::vector<size_t> compared;
  std::vector<Truth> truths;
  for (size_t i = 1; i <= kCompared; ++i) {
    compared.push_back(i * frames.size() / kCompared - 1);
    truths.push_back(organ.solve({push(site, frames[compared.back()])}));
  }
  std::vector<Answer> answers;
  for (const pal_model model : models_for_one(organ)) {
    ModelUnitSession session(organ.opened(), model, 1, 0);
    std::vector<std::vector<Answer>> seen;
    size_t next = 0;
    for (size_t frame = 0; frame < frames.size(); ++frame) {
      const std::vector<pal_contact> contacts = {push(site, frames[frame])};
      const auto results = session.contact_frame(contacts);
      if (results.front().model == PAL_MODEL_ZONE && frame % kLag == 0) session.refine();
      if (frame != compared[next]) continue;
      seen.push_back(
          {organ.compare(asked_of(model), contacts, results, session.visual_frame(), truths[next])});
      ++next;
    }
    answers.push_back(worst_of(seen, {0.02, 0.02}).front());
  }
  return answers;
}

}  // namespace palpate::hard
