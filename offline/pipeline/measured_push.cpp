#include "offline/pipeline/measured_push.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <numeric>
#include <utility>

#include "offline/precompute/solver_threads.hpp"

namespace palpate {
namespace {

// Groups the truths by the site of the first contact: a session then prepares a single zone for a site.
std::vector<std::vector<size_t>> by_site(const std::vector<ContactTruth>& truths) {
  std::map<size_t, std::vector<size_t>> groups;
  for (size_t i = 0; i < truths.size(); ++i) groups[truths[i].contacts.front().site].push_back(i);
  std::vector<std::vector<size_t>> listed;
  listed.reserve(groups.size());
  for (auto& [site, group] : groups) listed.push_back(std::move(group));
  return listed;
}

// Raises each entry of `largest` to the entry of `other`.
void keep_largest(std::vector<double>& largest, const std::vector<double>& other) {
  largest.resize(std::max(largest.size(), other.size()), 0.0);
  for (size_t i = 0; i < other.size(); ++i) largest[i] = std::max(largest[i], other[i]);
}

}  // namespace

std::vector<pal_contact> contacts_at(const std::vector<LinearContact>& contacts,
                                     const std::vector<std::uint32_t>& sites, double part) {
  std::vector<pal_contact> asked;
  asked.reserve(contacts.size());
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
  const Eigen::VectorXd difference = answer.field - truth.field;
  if (worst != nullptr) worst->resize(static_cast<size_t>(difference.size() / 3), 0.0);
  for (Eigen::Index node = 0; node < difference.size() / 3; ++node) {
    const double off = difference.segment<3>(3 * node).norm();
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
  return measure_pushes(
      truths, [&] { return method; }, 1, {}, worst);
}

std::vector<MeasuredPush> measure_pushes(const std::vector<ContactTruth>& truths,
                                         const std::function<Method()>& make_method, int jobs,
                                         const std::function<void(int, int)>& progress,
                                         std::vector<double>* worst) {
  const double floor = kForceFloor * largest_force(truths);
  const std::vector<std::vector<size_t>> groups = by_site(truths);
  std::vector<MeasuredPush> pushes(truths.size());
  std::vector<std::vector<double>> worst_of_worker(static_cast<size_t>(std::max(1, jobs)));
  const auto measure = [&](size_t worker, size_t g) {
    const Method method = make_method();
    for (const size_t i : groups[g]) {
      if (!truths[i].solved) continue;
      pushes[i] = measure_push(truths[i], method(truths[i].contacts), floor,
                               worst != nullptr ? &worst_of_worker[worker] : nullptr);
    }
  };
  for_each_on_threads(groups.size(), jobs, measure, progress);
  if (worst != nullptr) {
    for (const std::vector<double>& one : worst_of_worker) keep_largest(*worst, one);
  }
  return pushes;
}

Method runtime_method(ModelUnitSession& session, std::vector<std::uint32_t> sites) {
  return [&session, sites = std::move(sites),
          at_rest = session.visual_frame()](const std::vector<LinearContact>& contacts) {
    const std::vector<pal_contact_result> results = session.settle(contacts_at(contacts, sites, 1));
    return answer_of(results, session.visual_frame() - at_rest);
  };
}

Method runtime_method(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts,
                      std::uint32_t zone_rings, bool refines) {
  auto session =
      std::make_shared<ModelUnitSession>(opened, model, max_contacts, 0, zone_rings, 0, false, refines);
  std::vector<std::uint32_t> sites(opened.info().num_sites);
  std::iota(sites.begin(), sites.end(), 0u);
  return [session, answer = runtime_method(*session, std::move(sites))](
             const std::vector<LinearContact>& contacts) { return answer(contacts); };
}

}  // namespace palpate
