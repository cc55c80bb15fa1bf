#include "offline/cli/measured_push.hpp"

#include <algorithm>
#include <utility>

namespace palpate {
namespace {

constexpr double kForceFloor = 0.05;  // as in surveys

}  // namespace

std::vector<ContactTruth> truths_of(std::vector<SurveySample> samples) {
  std::vector<ContactTruth> truths;
  for (SurveySample& sample : samples) {
    ContactTruth truth{{{sample.site, sample.truth.displacement}}, sample.solved, {}, {}};
    if (sample.solved) {
      truth.field = std::move(sample.truth.field);
      truth.forces = {sample.truth.force};
    }
    truths.push_back(std::move(truth));
  }
  return truths;
}

std::vector<MeasuredPush> measure_pushes(const std::vector<ContactTruth>& truths, const Method& method,
                                         std::vector<double>* worst) {
  double largest_force = 0;
  for (const ContactTruth& truth : truths) {
    for (const Eigen::Vector3d& force : truth.forces) largest_force = std::max(largest_force, force.norm());
  }
  std::vector<MeasuredPush> pushes(truths.size());
  for (size_t i = 0; i < truths.size(); ++i) {
    const ContactTruth& truth = truths[i];
    if (!truth.solved) continue;
    MeasuredPush& push = pushes[i];
    const MethodAnswer answer = method(truth.contacts);
    const double size = truth.largest_displacement();
    const Eigen::VectorXd wrong = answer.field - truth.field;
    if (worst != nullptr) worst->resize(static_cast<size_t>(wrong.size() / 3), 0.0);
    for (Eigen::Index node = 0; node < wrong.size() / 3; ++node) {
      const double off = wrong.segment<3>(3 * node).norm();
      push.displacement_off = std::max(push.displacement_off, off);
      if (worst != nullptr) {
        double& so_far = (*worst)[static_cast<size_t>(node)];
        so_far = std::max(so_far, off / size);
      }
    }
    push.displacement_error = push.displacement_off / size;
    push.force_error = push.force_error_unfloored = 0;
    for (size_t c = 0; c < truth.forces.size(); ++c) {
      const double off = (answer.forces[c] - truth.forces[c]).norm();
      const double force = truth.forces[c].norm();
      push.force_off = std::max(push.force_off, off);
      push.force_error = std::max(push.force_error, off / std::max(force, kForceFloor * largest_force));
      push.force_error_unfloored = std::max(push.force_error_unfloored, off / force);
    }
    push.displacement_estimate = answer.displacement_estimate;
    push.force_estimate = answer.force_estimate;
  }
  return pushes;
}

Method runtime_method(ModelUnitSession& session, std::vector<std::uint32_t> sites) {
  return [&session, sites = std::move(sites),
          at_rest = session.visual_frame()](const std::vector<LinearContact>& contacts) {
    std::vector<pal_contact> asked;
    for (const LinearContact& contact : contacts) {
      const Eigen::Vector3d& d = contact.displacement;
      asked.push_back({sites[contact.site], {d[0], d[1], d[2]}, 0, {}, {}, {}});
    }
    MethodAnswer answer;
    for (const pal_contact_result& result : session.settle(asked)) {
      answer.forces.emplace_back(result.force);
      answer.displacement_estimate = std::max(answer.displacement_estimate, result.displacement_error);
      answer.force_estimate = std::max(answer.force_estimate, result.force_error);
    }
    answer.field = session.visual_frame() - at_rest;
    return answer;
  };
}

}  // namespace palpate
