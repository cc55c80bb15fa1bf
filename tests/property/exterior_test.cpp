// The live exterior: a zone and the organ outside of it come to the equilibrium of the whole organ.
#include "runtime/src/zone/exterior.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "runtime/src/zone/acceleration.hpp"
#include "tests/support/condensed_organ.hpp"

namespace palpate {
namespace exterior_test {

using test::CondensedOrgan;
using test::ContactAnswer;
using test::Memory;
using test::tissue_block;
using test::ZoneBlock;

// A zone about several contacts that Eigen solves, and the runtime's exterior.
class LiveOrgan {
 public:
  LiveOrgan(const ZoneBlock& organ, const std::vector<pal_contact>& contacts, int rings)
      : organ_(organ),
        contacts_(contacts),
        of_(organ, zone_elements(organ, contacts, rings)),
        memory_([&](Arena& arena) {
          carve_organ_state(of_.pack, arena, state_);
          carve_acceleration(size_t{3} * of_.pack.organ.num_nodes, arena, acceleration_);
        }),
        zone_model_(organ.block.model) {
    EXPECT_TRUE(of_.run());
    rest_organ(of_.pack, of_.elements, state_);
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

  // Moves the contacts by this part of their displacements, with the rest of the zone along the tangent, and solves the zone.
  void move(double part) {
    Eigen::VectorXd change = Eigen::VectorXd::Zero(u_.size());
    for (const pal_contact& contact : contacts_) {
      for (const int node : organ_.block.sites.sites[contact.site].patch_nodes)
        change.segment<3>(3 * node) = rest_.segment<3>(3 * node) +
                                      part * Eigen::Vector3d(contact.displacement) - u_.segment<3>(3 * node);
    }
    const Eigen::MatrixXd stiffness = tangent();
    const Eigen::VectorXd forces = stiffness * change(zone_->equation_dofs());
    change(dofs_) -= (stiffness(unknowns_, unknowns_) + outside_).ldlt().solve(forces(unknowns_));
    u_ += change;
    solve_zone();
  }

  // An iteration of the exterior and the zone's answer. Returns false where an element would be inverted.
  bool iterate(bool accelerated) {
    const pal_pack& pack = of_.pack;
    std::vector<double> zone(size_t{3} * pack.organ.num_nodes);
    for (uint32_t i = 0; i < pack.organ.num_nodes; ++i) {
      for (int axis = 0; axis < 3; ++axis) zone[3 * i + static_cast<uint32_t>(axis)] = u_[dof(i, axis)];
    }
    const std::vector<double> before(state_.displacement, state_.displacement + zone.size());
    extend_exterior(pack, of_.exterior, of_.kernel, zone.data(), of_.scratch, state_);
    if (accelerated) {
      accelerate(before.data(), state_.displacement, acceleration_);
      for (uint32_t i = 0; i < pack.organ.num_nodes; ++i) {
        for (int axis = 0; axis < 3; ++axis)
          u_[dof(i, axis)] = state_.displacement[3 * i + static_cast<uint32_t>(axis)];
      }
    }
    if (!evaluate_organ(pack, of_.elements, state_)) return false;
    Eigen::VectorXd own;
    zone_->internal_force(u_, own);
    own -= rest_force_;
    std::vector<double> kept;
    for (uint32_t i = 0; i < of_.exterior.num_kept; ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        const bool is_free = (pack.organ.nodes[of_.exterior.kept[i]].free_axes >> axis & 1) != 0;
        kept.push_back(is_free ? own[dof(of_.exterior.kept[i], axis)] : 0);
      }
    }
    condense_exterior(of_.exterior, of_.kernel, kept.data(), of_.scratch, state_);
    solve_zone();
    return true;
  }

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
          outside_(i, j) = of_.exterior.schur[static_cast<uint32_t>(column) * of_.exterior.schur_stride +
                                              static_cast<uint32_t>(row)];
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
      const Eigen::VectorXd step = (tangent()(unknowns_, unknowns_) + outside_).ldlt().solve(forces);
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
  OrganState state_;
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

const std::vector<pal_contact> kOne = {{4, {0.03, -0.02, -0.1}, 0, {}, {}, {}}};
const std::vector<pal_contact> kNeighbours = {{0, {0.03, 0, -0.1}, 0, {}, {}, {}},
                                              {8, {-0.03, 0.02, -0.1}, 0, {}, {}, {}}};

std::vector<double> errors_of(const ZoneBlock& organ, const std::vector<pal_contact>& contacts, int rings,
                              int iterations) {
  const ContactAnswer truth = organ.solve(contacts);
  LiveOrgan live(organ, contacts, rings);
  for (int step = 1; step <= 4; ++step) live.move(0.25 * step);
  std::vector<double> errors;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    EXPECT_TRUE(live.iterate(true));
    errors.push_back(live.error(truth));
  }
  return errors;
}

TEST(Exterior, ComesToTheEquilibriumOfTheWholeOrgan) {
  for (const auto* contacts : {&kOne, &kNeighbours}) {
    const std::vector<double> errors = errors_of(tissue_block(2), *contacts, 1, 14);
    SCOPED_TRACE(testing::PrintToString(errors));
    EXPECT_LT(errors[3], 0.1 * errors[0]);
    EXPECT_LT(errors.back(), 1e-7);
  }
}

TEST(Exterior, ComesThereUnderGravityWithTenNodes) {
  const std::vector<pal_contact> contacts = {{0, {0.03, -0.02, -0.1}, 0, {}, {}, {}}};
  const std::vector<double> errors =
      errors_of(tissue_block(1, true, Eigen::Vector3d(0, 0.1, -0.3), 2, 0.6), contacts, 1, 14);
  SCOPED_TRACE(testing::PrintToString(errors));
  EXPECT_LT(errors.back(), 1e-7);
}

TEST(Exterior, ComesThereWithSharedVolumes) {
  const std::vector<pal_contact> contacts = {{0, {0.03, -0.02, -0.1}, 0, {}, {}, {}}};
  const std::vector<double> errors =
      errors_of(tissue_block(1, false, Eigen::Vector3d::Zero(), 3, 0.4, false, true), contacts, 1, 14);
  SCOPED_TRACE(testing::PrintToString(errors));
  EXPECT_LT(errors.back(), 1e-7);
}

// y <- A y + b with eigenvalues beyond 1: plain iteration diverges.
TEST(Acceleration, FindsTheFixedPointOfALinearMapThatDiverges) {
  constexpr size_t kSize = 40;
  Acceleration acceleration;
  const Memory memory([&](Arena& arena) { carve_acceleration(kSize, arena, acceleration); });
  restart_acceleration(acceleration);
  const double slopes[] = {-1.5, 0.9, 0.2, -0.3};
  std::vector<double> y(kSize, 0.0);
  for (int iteration = 0; iteration < 12; ++iteration) {
    std::vector<double> image(kSize);
    for (size_t i = 0; i < kSize; ++i) image[i] = slopes[i % 4] * y[i] + 1.0 + 0.1 * static_cast<double>(i);
    accelerate(y.data(), image.data(), acceleration);
    y = image;
  }
  for (size_t i = 0; i < kSize; ++i)
    EXPECT_NEAR(y[i], (1.0 + 0.1 * static_cast<double>(i)) / (1 - slopes[i % 4]), 1e-8);
}

}  // namespace exterior_test
}  // namespace palpate
