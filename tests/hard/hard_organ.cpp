#include "tests/hard/hard_organ.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "offline/mesh/surface.hpp"
#include "offline/pipeline/build_plan.hpp"
#include "offline/pipeline/pack_build.hpp"

namespace palpate::hard {
namespace {

Scene scene_of(const OrganSpec& spec) {
  Scene scene;
  scene.file = "hard case";
  scene.sites = spec.sites;
  scene.max_displacement = spec.max_displacement;
  scene.tip_radius = spec.tip_radius;
  scene.max_contacts = spec.max_contacts;
  scene.polynomial = spec.polynomial;
  if (spec.fewest) scene.sampled_sites = SampledSites::fewest;
  scene.accuracy_target = spec.target;
  scene.precision = spec.precision;
  scene.zone = true;
  scene.zone_rings = spec.zone_rings;
  scene.output_nodes = extract_surface(spec.model).nodes;
  return scene;
}

double error_over_bar(const Answer& answer, const Bar& bar) {
  const double force = std::isnan(answer.force_error) ? 0 : answer.force_error / bar.force;
  return std::max(answer.displacement_error / bar.displacement, force);
}

// Unsound answers are worst, then cases without an answer.
int badness(Verdict verdict) {
  return is_sound(verdict) ? static_cast<int>(verdict != Verdict::answered) : 2;
}

}  // namespace

Organ::Organ(OrganSpec spec) : Organ(spec.model, scene_of(spec), spec.survey_samples) {}

Organ::Organ(Model model, Scene scene, int survey_samples)
    : model_(std::move(model)),
      scene_(std::move(scene)),
      sites_(find_contact_sites(scene_, model_)),
      assembly_(std::make_unique<Assembly>(model_, model_.fixed_dofs())),
      rest_(find_rest(*assembly_, scene_)) {
  SamplingPlan plan = plan_sampling(scene_, sites_, 1);
  if (survey_samples > 0) plan.survey_samples = survey_samples;
  const std::unique_ptr<PackBuild> build = build_pack({*assembly_, scene_, sites_, rest_, plan}, {});
  sites_ = build->sites;
  bytes_ = std::make_unique<AlignedBytes>(std::move(*build->bytes));
  opened_ = std::make_unique<OpenedPack>(*bytes_);
}

std::uint32_t Organ::site_near(const Eigen::Vector3d& place) const {
  const auto distance = [&](const ContactSite& site) {
    return (model_.positions[static_cast<size_t>(site.node)] - place).norm();
  };
  const auto nearest =
      std::min_element(sites_.sites.begin(), sites_.sites.end(),
                       [&](const ContactSite& a, const ContactSite& b) { return distance(a) < distance(b); });
  return static_cast<std::uint32_t>(nearest - sites_.sites.begin());
}

Truth Organ::solve(const std::vector<pal_contact>& contacts, int increments,
                   const std::vector<int>& fixed_nodes, const std::vector<pal_contact>& way) const {
  std::vector<int> holders(model_.positions.size(), 0);
  for (const pal_contact& contact : contacts) {
    for (const int node : sites_.sites[contact.site].patch_nodes) ++holders[static_cast<size_t>(node)];
  }
  const auto load_of = [&](const std::vector<pal_contact>& pushes) {
    LoadCase load = rest_.load_case(model_);
    for (const pal_contact& contact : pushes) {
      for (const int node : sites_.sites[contact.site].patch_nodes) {
        for (int axis = 0; axis < 3; ++axis) {
          load.held[static_cast<size_t>(3 * node + axis)] = 1;
          load.displacement[3 * node + axis] +=
              contact.displacement[axis] / holders[static_cast<size_t>(node)];
        }
      }
    }
    for (const int node : fixed_nodes) {
      for (int axis = 0; axis < 3; ++axis) load.held[static_cast<size_t>(3 * node + axis)] = 1;
      load.displacement.segment<3>(3 * node).setZero();
    }
    return load;
  };
  StaticSolver solver(*assembly_);
  SolverSettings settings;
  settings.largest_increment = settings.first_increment = 1.0 / increments;
  settings.max_increments = 1000;
  Eigen::VectorXd u = rest_.displacement_of(model_);
  Truth truth;
  LoadCase from = rest_.load_case(model_);
  for (const std::vector<pal_contact>& goal : {way, contacts}) {
    if (goal.empty()) continue;
    const LoadCase to = load_of(goal);
    truth.solved = solver.ramp(from, to, u, settings).converged;
    if (!truth.solved) return truth;
    from = to;
  }
  Eigen::VectorXd internal;
  assembly_->internal_force(u, internal);
  truth.field = packed_rows(sites_, u);
  for (const pal_contact& contact : contacts) {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (const int node : sites_.sites[contact.site].patch_nodes) {
      // The support of a fixed node bears its force; no contact does.
      if (std::find(fixed_nodes.begin(), fixed_nodes.end(), node) == fixed_nodes.end())
        force += internal.segment<3>(3 * node) / holders[static_cast<size_t>(node)];
    }
    truth.forces.push_back(force);
  }
  return truth;
}

Answer Organ::compare(const std::string& by, const std::vector<pal_contact>& contacts,
                      const std::vector<pal_contact_result>& results, const Eigen::VectorXd& field,
                      const Truth& truth) const {
  Answer answer;
  answer.by = by;
  answer.finite = field.allFinite();
  double push = 0;
  double largest_force = 0;
  for (const pal_contact& contact : contacts)
    push = std::max(push, Eigen::Vector3d(contact.displacement).norm());
  for (const Eigen::Vector3d& force : truth.forces) largest_force = std::max(largest_force, force.norm());
  std::uint32_t flags = 0;
  for (size_t c = 0; c < results.size(); ++c) {
    const Eigen::Vector3d force(results[c].force);
    answer.finite = answer.finite && force.allFinite() &&
                    Eigen::Map<const Eigen::Matrix3d>(results[c].stiffness[0]).allFinite();
    flags |= results[c].flags;
    answer.estimated_displacement_error =
        std::max(answer.estimated_displacement_error, results[c].displacement_error);
    answer.estimated_force_error = std::max(answer.estimated_force_error, results[c].force_error);
    if (!truth.solved) continue;
    const double size = std::max(truth.forces[c].norm(), kForceFloor * largest_force);
    const double error = (force - truth.forces[c]).norm();
    const double relative = error == 0 ? 0 : error / size;
    answer.force_error = std::isnan(answer.force_error) ? relative : std::max(answer.force_error, relative);
  }
  // An answer that is not refined is one to first order, whose estimate holds.
  answer.flags = flag_names(flags & ~std::uint32_t{PAL_FLAG_UNREFINED});
  if (truth.solved) {
    const Eigen::VectorXd wrong = field - truth.field;
    answer.displacement_error =
        wrong.reshaped(3, wrong.size() / 3).colwise().norm().maxCoeff() / (push > 0 ? push : edge());
    answer.happened =
        fmt::format("{} answered", model_name(results.empty() ? PAL_MODEL_AUTO : results[0].model));
  } else {
    answer.happened = "the full solve finds no equilibrium";
  }
  return answer;
}

Answer Organ::ask(pal_model model, const std::vector<pal_contact>& contacts, const Truth& truth) const {
  const std::string by = asked_of(model);
  try {
    ModelUnitSession session(*opened_, model,
                             static_cast<std::uint32_t>(std::max<size_t>(1, contacts.size())), 0);
    const std::vector<pal_contact_result> results = session.settle(contacts);
    return compare(by, contacts, results, session.visual_frame(), truth);
  } catch (const std::exception& error) {
    return refused(by, error.what());
  }
}

pal_contact push(std::uint32_t site, const Eigen::Vector3d& displacement) {
  return {site, {displacement[0], displacement[1], displacement[2]}, 0, {}, {}, {}};
}

std::vector<pal_model> models_for_one(const Organ& organ) {
  std::vector<pal_model> models = {PAL_MODEL_AUTO, PAL_MODEL_LINEAR};
  if (organ.opened().info().has_polynomial != 0) models.push_back(PAL_MODEL_POLYNOMIAL);
  if (organ.scene().sampled_sites == SampledSites::fewest) models.push_back(PAL_MODEL_AFFINE);
  models.push_back(PAL_MODEL_ZONE);
  return models;
}

std::string asked_of(pal_model model) {
  return model == PAL_MODEL_AUTO ? "auto" : model_name(model);
}

std::vector<Answer> ask_all(const Organ& organ, const std::vector<pal_contact>& contacts,
                            const std::vector<pal_contact>& way) {
  const Truth truth = organ.solve(contacts, 8, {}, way);
  std::vector<pal_model> models = {PAL_MODEL_AUTO, PAL_MODEL_LINEAR};
  if (contacts.size() <= 1) {
    models = models_for_one(organ);
  } else if (contacts.size() <= pack::kMostZoneContacts) {
    models.push_back(PAL_MODEL_ZONE);
  }
  std::vector<Answer> answers;
  for (const pal_model model : models) answers.push_back(organ.ask(model, contacts, truth));
  return answers;
}

std::vector<Answer> worst_of(const std::vector<std::vector<Answer>>& sets, const Bar& bar) {
  std::vector<Answer> worst;
  std::vector<std::map<Verdict, int>> counts;
  for (const std::vector<Answer>& set : sets) {
    for (size_t i = 0; i < set.size(); ++i) {
      const Verdict verdict = judge(set[i], bar);
      if (i == worst.size()) {
        worst.push_back(set[i]);
        counts.emplace_back();
      } else if (badness(verdict) != badness(judge(worst[i], bar))
                     ? badness(verdict) > badness(judge(worst[i], bar))
                     : !(error_over_bar(set[i], bar) <= error_over_bar(worst[i], bar))) {
        worst[i] = set[i];
      }
      ++counts[i][verdict];
    }
  }
  for (size_t i = 0; i < worst.size(); ++i) {
    std::string text = fmt::format("the worst of {}: ", sets.size());
    for (const auto& [verdict, count] : counts[i])
      text += fmt::format("{}{} {}", text.ends_with(": ") ? "" : ", ", count, words_for(verdict));
    worst[i].happened = worst[i].refused ? text + "; " + worst[i].happened : text;
  }
  return worst;
}

const Organ& shared_organ(const std::string& name, const std::function<OrganSpec()>& spec) {
  static std::map<std::string, std::unique_ptr<Organ>> organs;
  std::unique_ptr<Organ>& organ = organs[name];
  if (!organ) organ = std::make_unique<Organ>(spec());
  return *organ;
}

}  // namespace palpate::hard
