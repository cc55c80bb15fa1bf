#include "offline/cli/measured_push.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace palpate {
namespace {

std::vector<pal_contact> asked_of(const std::vector<LinearContact>& contacts,
                                  const std::vector<std::uint32_t>& sites, double part) {
  std::vector<pal_contact> asked;
  for (const LinearContact& contact : contacts) {
    const Eigen::Vector3d d = part * contact.displacement;
    asked.push_back({sites[contact.site], {d[0], d[1], d[2]}, 0, {}, {}, {}});
  }
  return asked;
}

MethodAnswer answer_of(const std::vector<pal_contact_result>& results, const Eigen::VectorXd& field) {
  MethodAnswer answer;
  for (const pal_contact_result& result : results) {
    answer.forces.emplace_back(result.force);
    answer.displacement_estimate = std::max(answer.displacement_estimate, result.displacement_error);
    answer.force_estimate = std::max(answer.force_estimate, result.force_error);
    answer.flags |= result.flags;
  }
  answer.field = field;
  return answer;
}

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

double largest_force(const std::vector<ContactTruth>& truths) {
  double largest = 0;
  for (const ContactTruth& truth : truths) {
    for (const Eigen::Vector3d& force : truth.forces) largest = std::max(largest, force.norm());
  }
  return largest;
}

MeasuredPush measure_push(const ContactTruth& truth, const MethodAnswer& answer, double floor,
                          std::vector<double>* worst) {
  MeasuredPush push;
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
    push.force_error = std::max(push.force_error, off / std::max(force, floor));
    push.force_error_unfloored = std::max(push.force_error_unfloored, off / force);
  }
  push.displacement_estimate = answer.displacement_estimate;
  push.force_estimate = answer.force_estimate;
  return push;
}

std::vector<MeasuredPush> measure_pushes(const std::vector<ContactTruth>& truths, const Method& method,
                                         std::vector<double>* worst) {
  const double floor = kForceFloor * largest_force(truths);
  std::vector<MeasuredPush> pushes(truths.size());
  // Site by site, so that a zone is made ready once for all of a site's pushes.
  std::vector<size_t> order(truths.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return truths[a].contacts.front().site < truths[b].contacts.front().site;
  });
  for (const size_t i : order) {
    if (truths[i].solved) pushes[i] = measure_push(truths[i], method(truths[i].contacts), floor, worst);
  }
  return pushes;
}

Method runtime_method(ModelUnitSession& session, std::vector<std::uint32_t> sites) {
  return [&session, sites = std::move(sites),
          at_rest = session.visual_frame()](const std::vector<LinearContact>& contacts) {
    const std::vector<pal_contact_result> results = session.settle(asked_of(contacts, sites, 1));
    return answer_of(results, session.visual_frame() - at_rest);
  };
}

Method moving_method(ModelUnitSession& session, std::vector<std::uint32_t> sites, int frames) {
  return [&session, sites = std::move(sites), frames,
          at_rest = session.visual_frame()](const std::vector<LinearContact>& contacts) {
    session.contact_frame({});  // at rest
    std::vector<pal_contact_result> results;
    for (int frame = 1; frame <= frames; ++frame)
      results = session.contact_frame(asked_of(contacts, sites, static_cast<double>(frame) / frames));
    return answer_of(results, session.visual_frame() - at_rest);
  };
}

}  // namespace palpate
