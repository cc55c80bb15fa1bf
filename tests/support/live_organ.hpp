// A zone that Eigen solves, and the runtime's live exterior.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "offline/numerics/decompositions.hpp"
#include "runtime/src/exterior/exterior.hpp"
#include "tests/support/condensed_organ.hpp"

namespace palpate::test {

// A zone about several contacts that Eigen solves, and the runtime's exterior.
class LiveOrgan {
 public:
  LiveOrgan(const ZoneBlock& organ, const std::vector<pal_contact>& contacts, int rings)
      : organ_(organ),
        contacts_(contacts),
        of_(organ, zone_elements(organ, contacts, rings)),
        memory_([&](Arena& arena) {
          carve_exterior(of_.pack, arena, state_);
          carve_acceleration(size_t{3} * of_.pack.organ.num_nodes, arena, acceleration_);
        }),
        zone_model_(organ.block.model) {
    EXPECT_TRUE(of_.run());
    rest_exterior(of_.outside(), state_);
    restart_acceleration(acceleration_);
    zone_model_.elements.clear();
    for (size_t i = 0; i < of_.tree.elements.size(); ++i) {
      if (of_.is_zone_element[i] != 0)
        zone_model_.elements.push_back(organ.block.model.elements[static_cast<size_t>(of_.tree.elements[i])]);
    }
    zone_.emplace(zone_model_, zone_model_.fixed_dofs());
    rest_ = organ.rest.displacement_of(organ.block.model);
    u_ = rest_;
    zone_->internal_force(rest_, rest_force_);
    list_unknowns();
    take_outside();
  }

  // The force on a contact.
  Eigen::Vector3d force(size_t contact) const {
    Eigen::VectorXd forces;
    zone_->internal_force(u_, forces);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int node : organ_.block.sites.sites[contacts_[contact].site].patch_nodes)
      sum += forces.segment<3>(3 * node) - rest_force_.segment<3>(3 * node);
    return sum;
  }

  // Moves the contacts by this part of their displacements, with the rest of the zone along the tangent, and solves the zone.
  void move(double part) {
    move_without_solving(part);
    solve_zone();
  }
  void move_without_solving(double part) {
    Eigen::VectorXd change = Eigen::VectorXd::Zero(u_.size());
    for (const pal_contact& contact : contacts_) {
      for (const int node : organ_.block.sites.sites[contact.site].patch_nodes)
        change.segment<3>(3 * node) = rest_.segment<3>(3 * node) +
                                      part * Eigen::Vector3d(contact.displacement) - u_.segment<3>(3 * node);
    }
    const Eigen::MatrixXd stiffness = tangent();
    const Eigen::VectorXd forces = stiffness * change(zone_->equation_dofs());
    change(dofs_) -= solve_definite(stiffness(unknowns_, unknowns_) + outside_, forces(unknowns_));
    u_ += change;
    restart_acceleration(acceleration_);  // iterates of other contacts say nothing of the next ones
  }

  // An iteration of the exterior in slices of so many multiply-adds, then the zone's answer. Returns false where an element
  // would be inverted.
  bool iterate(uint64_t slice = UINT64_MAX) {
    const pal_pack& pack = of_.pack;
    std::vector<double> zone(size_t{3} * pack.organ.num_nodes);
    for (uint32_t i = 0; i < pack.organ.num_nodes; ++i) {
      for (int axis = 0; axis < 3; ++axis) zone[3 * i + static_cast<uint32_t>(axis)] = u_[dof(i, axis)];
    }
    begin_iteration(of_.outside(), of_.exterior, zone.data(), state_);
    Progress progress;
    do {
      uint64_t spent = 0;
      progress =
          advance_iteration(of_.outside(), of_.exterior, slice, of_.scratch, acceleration_, state_, spent);
    } while (progress == Progress::goes_on);
    if (progress == Progress::failed) return false;
    for (uint32_t i = 0; i < pack.organ.num_nodes; ++i) {
      for (int axis = 0; axis < 3; ++axis)
        u_[dof(i, axis)] = state_.displacement[3 * i + static_cast<uint32_t>(axis)];
    }
    solve_zone();
    return true;
  }

  const ExteriorState& state() const { return state_; }
  size_t num_values() const { return size_t{3} * of_.pack.organ.num_nodes; }
  const Eigen::VectorXd& displacement() const { return u_; }

  // The largest error of any node over the largest |d|.
  double error(const ContactAnswer& truth) const {
    double push = 0;
    for (const pal_contact& contact : contacts_)
      push = std::max(push, Eigen::Vector3d(contact.displacement).norm());
    Eigen::VectorXd all = rest_;
    for (uint32_t i = 0; i < of_.pack.organ.num_nodes; ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        const bool outside = of_.exterior.roles[i] == NodeRole::eliminated;
        all[dof(i, axis)] =
            outside ? state_.displacement[3 * i + static_cast<uint32_t>(axis)] : u_[dof(i, axis)];
      }
    }
    const Eigen::VectorXd field = packed_rows(organ_.block.sites, all);
    return (field - truth.field).lpNorm<Eigen::Infinity>() / push;
  }

 private:
  static std::vector<int> zone_elements(const ZoneBlock& organ, const std::vector<pal_contact>& contacts,
                                        int rings) {
    const ZoneFinder finder(organ.block.model);
    std::vector<int> elements;
    for (const pal_contact& contact : contacts) {
      const std::vector<int> about = finder.elements_about(organ.block.sites.sites[contact.site], rings);
      elements.insert(elements.end(), about.begin(), about.end());
    }
    return elements;
  }

  Eigen::Index dof(uint32_t node, int axis) const { return 3 * of_.tree.nodes[node] + axis; }

  // Nodes of the zone that no contact holds.
  void list_unknowns() {
    std::vector<char> held(static_cast<size_t>(zone_model_.num_nodes()), 0);
    for (const pal_contact& contact : contacts_) {
      for (const int node : organ_.block.sites.sites[contact.site].patch_nodes)
        held[static_cast<size_t>(node)] = 1;
    }
    std::vector<int> kept_place(static_cast<size_t>(zone_model_.num_nodes()), -1);
    for (uint32_t i = 0; i < of_.exterior.num_kept; ++i)
      kept_place[static_cast<size_t>(of_.tree.nodes[of_.exterior.kept[i]])] = static_cast<int>(i);
    for (int equation = 0; equation < zone_->num_equations(); ++equation) {
      const int at = zone_->equation_dofs()[static_cast<size_t>(equation)];
      if (held[static_cast<size_t>(at / 3)] != 0) continue;
      unknowns_.push_back(equation);
      dofs_.push_back(at);
      const int place = kept_place[static_cast<size_t>(at / 3)];
      kept_rows_.push_back(place < 0 ? -1 : 3 * place + at % 3);
    }
  }

  Eigen::MatrixXd tangent() const {
    SparseLower lower;
    zone_->tangent(u_, false, lower);
    return Eigen::MatrixXd(lower).selfadjointView<Eigen::Lower>();
  }

  // S on the zone's unknowns.
  void take_outside() {
    const auto size = static_cast<Eigen::Index>(unknowns_.size());
    outside_ = Eigen::MatrixXd::Zero(size, size);
    for (Eigen::Index i = 0; i < size; ++i) {
      for (Eigen::Index j = 0; j < size; ++j) {
        const int row = kept_rows_[static_cast<size_t>(i)];
        const int column = kept_rows_[static_cast<size_t>(j)];
        if (row >= 0 && column >= 0)
          outside_(i, j) = static_cast<double>(
              of_.exterior.schur[static_cast<uint32_t>(column) * of_.exterior.schur_stride +
                                 static_cast<uint32_t>(row)]);
      }
    }
  }

  // The forces on the zone's unknowns: P(u) + g + S (u_B - u_B of the exterior).
  Eigen::VectorXd residual() const {
    const auto size = static_cast<Eigen::Index>(unknowns_.size());
    Eigen::VectorXd force;
    zone_->internal_force(u_, force);
    Eigen::VectorXd sum(size);
    Eigen::VectorXd moved = Eigen::VectorXd::Zero(size);
    for (Eigen::Index i = 0; i < size; ++i) {
      const int at = dofs_[static_cast<size_t>(i)];
      sum[i] = force[at] - rest_force_[at];
      const int row = kept_rows_[static_cast<size_t>(i)];
      if (row < 0) continue;
      const size_t place = size_t{3} * of_.exterior.kept[row / 3] + static_cast<size_t>(row % 3);
      moved[i] = u_[at] - state_.displacement[place];
      sum[i] += state_.forces[place];
    }
    return sum + outside_ * moved;
  }

  // Newton's method; a step is cut until it inverts no element.
  void solve_zone() {
    for (int iteration = 0; iteration < 30; ++iteration) {
      const Eigen::VectorXd forces = residual();
      if (forces.norm() < 1e-13) return;
      const Eigen::VectorXd step = solve_definite(tangent()(unknowns_, unknowns_) + outside_, forces);
      for (double part = 1; part > 1e-3; part *= 0.5) {
        Eigen::VectorXd next = u_;
        next(dofs_) -= part * step;
        Eigen::VectorXd unused;
        if (zone_->internal_force(next, unused).min_jacobian <= 0) continue;
        u_ = next;
        break;
      }
    }
  }

  const ZoneBlock& organ_;
  std::vector<pal_contact> contacts_;
  CondensedOrgan of_;
  ExteriorState state_;
  Acceleration acceleration_;
  Memory memory_;
  Model zone_model_;
  std::optional<Assembly> zone_;
  Eigen::VectorXd rest_;
  Eigen::VectorXd rest_force_;
  Eigen::VectorXd u_;
  Eigen::MatrixXd outside_;
  std::vector<int> unknowns_;  // equations of zone_
  std::vector<int> dofs_;
  std::vector<int> kept_rows_;  // -1: inside of the zone
};

}  // namespace palpate::test
