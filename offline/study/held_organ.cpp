#include "offline/study/held_organ.hpp"

#include <fmt/core.h>

namespace palpate {
namespace {

std::vector<std::vector<int>> patches_at(const Organ& organ, const std::vector<size_t>& sites) {
  std::vector<std::vector<int>> patches;
  for (const size_t site : sites) patches.push_back(organ.sites.sites[site].patch_nodes);
  return patches;
}

}  // namespace

HeldOrgan::HeldOrgan(const Organ& organ, const std::vector<size_t>& sites)
    : held_(organ.assembly, patches_at(organ, sites), organ.rest.displacement_of(organ.model)),
      back_solve_(held_) {
  std::vector<int> place(static_cast<size_t>(organ.model.num_dofs()), -1);
  for (size_t i = 0; i < held_.free_dofs.size(); ++i)
    place[static_cast<size_t>(held_.free_dofs[i])] = static_cast<int>(i);
  const std::vector<int>& packed = organ.sites.packed_nodes;
  contact_of_.assign(3 * packed.size(), -1);
  for (size_t i = 0; i < contact_of_.size(); ++i) {
    const int free = place[static_cast<size_t>(3 * packed[i / 3]) + i % 3];
    if (free < 0) continue;
    shown_.push_back(free);
    shown_at_.push_back(static_cast<int>(i));
  }
  for (size_t contact = 0; contact < sites.size(); ++contact) {
    for (const int node : organ.sites.sites[sites[contact]].patch) {
      for (size_t axis = 0; axis < 3; ++axis)
        contact_of_[3 * static_cast<size_t>(organ.sites.contact_nodes[static_cast<size_t>(node)]) + axis] =
            static_cast<int>(3 * contact + axis);
    }
  }
}

bool HeldOrgan::has_whole_nodes() const {
  const std::vector<int>& dofs = held_.free_dofs;
  if (dofs.size() % 3 != 0) return false;
  for (size_t i = 0; i < dofs.size(); ++i) {
    if (dofs[i] != dofs[i - i % 3] + static_cast<int>(i % 3) || dofs[i - i % 3] % 3 != 0) return false;
  }
  return true;
}

FixedTensor& HeldOrgan::tensor() {
  if (!tensor_) tensor_.emplace(held_, back_solve_, &shown_);
  return *tensor_;
}

LocalizedCg& HeldOrgan::localized_cg(double tolerance) {
  return localized_cg_.try_emplace(tolerance, held_, true, tolerance).first->second;
}

void HeldOrgan::haptic(const HeldMethod& method, const Eigen::VectorXd& displacement) {
  if (method.kind == MethodKind::fixed_tensor) {
    tensor().force_frame(displacement);
    force_ = tensor().force();
  } else if (method.kind == MethodKind::localized_cg) {
    force_ = held_.force(localized_cg(method.tolerance).frame(displacement), displacement);
  } else {
    force_ = held_.force(back_solve_.frame(displacement), displacement);
  }
}

void HeldOrgan::visual(const HeldMethod& method, const Eigen::VectorXd& displacement) {
  if (method.kind == MethodKind::fixed_tensor) tensor().field_frame(displacement);
}

MethodAnswer HeldOrgan::answer(const HeldMethod& method, const std::vector<LinearContact>& contacts) {
  Eigen::VectorXd displacement(3 * static_cast<Eigen::Index>(contacts.size()));
  for (size_t c = 0; c < contacts.size(); ++c)
    displacement.segment<3>(3 * static_cast<Eigen::Index>(c)) = contacts[c].displacement;
  haptic(method, displacement);
  visual(method, displacement);
  MethodAnswer answer;
  answer.field = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(contact_of_.size()));
  if (method.kind == MethodKind::fixed_tensor) {
    answer.field(shown_at_) = tensor().displacement().cast<double>();
  } else if (method.kind == MethodKind::localized_cg) {
    answer.field(shown_at_) = localized_cg(method.tolerance).displacement()(shown_);
  } else {
    answer.field(shown_at_) = back_solve_.displacement()(shown_);
  }
  for (size_t i = 0; i < contact_of_.size(); ++i) {
    if (contact_of_[i] >= 0) answer.field[static_cast<Eigen::Index>(i)] = displacement[contact_of_[i]];
  }
  for (size_t c = 0; c < contacts.size(); ++c)
    answer.forces.emplace_back(force_.segment<3>(3 * static_cast<Eigen::Index>(c)));
  return answer;
}

std::vector<HeldMethod> held_methods(const std::vector<double>& tolerances) {
  std::vector<HeldMethod> methods = {{MethodKind::back_solve, "linear, back-solve"},
                                     {MethodKind::fixed_tensor, "linear, PFE"}};
  for (const double tolerance : tolerances)
    methods.push_back({MethodKind::localized_cg, fmt::format("linear, LCG to {:g}", tolerance), tolerance});
  return methods;
}

}  // namespace palpate
