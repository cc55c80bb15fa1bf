// A block with all nodes packed and with nonlinear zones, and the full solve as reference.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "offline/mesh/volume_patches.hpp"
#include "offline/pack/pack_writer.hpp"
#include "offline/precompute/nonlinear_zone.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate::test {

struct ContactAnswer {
  Eigen::VectorXd field;  // displacements from rest
  std::vector<Eigen::Vector3d> forces;
  std::vector<Eigen::Vector3d> torques;  // about the sites' current positions
  double min_jacobian = 1;
};

// The full solve. Patches move and rotate about their sites; fixed nodes stay. A node of several patches
// takes the mean of their motions.
inline ContactAnswer solve_contacts(const TouchedBlock& block, const Assembly& assembly,
                                    const RestState& rest, const std::vector<pal_contact>& contacts,
                                    const std::vector<int>& fixed = {},
                                    const std::vector<Eigen::Matrix3d>& rotations = {}) {
  const LoadCase at_rest = rest.load_case(block.model);
  LoadCase load = at_rest;
  const Eigen::VectorXd u0 = rest.displacement_of(block.model);
  std::vector<int> holders(static_cast<size_t>(block.model.num_nodes()));
  for (const pal_contact& contact : contacts) {
    for (const int node : block.sites.sites[contact.site].patch_nodes) ++holders[static_cast<size_t>(node)];
  }
  const auto is_fixed = [&](int node) { return std::find(fixed.begin(), fixed.end(), node) != fixed.end(); };
  for (const int node : fixed) {
    for (int axis = 0; axis < 3; ++axis) {
      load.held[static_cast<size_t>(3 * node + axis)] = 1;
      load.displacement[3 * node + axis] = u0[3 * node + axis];
    }
  }
  // Vector from a contact's site to a node, rotated with the contact.
  const auto arm_of = [&](size_t c, int node, bool turned) -> Eigen::Vector3d {
    const int centre = block.sites.sites[contacts[c].site].node;
    const auto at = [&](int i) -> Eigen::Vector3d {
      return block.model.positions[static_cast<size_t>(i)] + u0.segment<3>(3 * i);
    };
    const Eigen::Vector3d arm = at(node) - at(centre);
    return turned && c < rotations.size() ? rotations[c] * arm : arm;
  };
  for (size_t c = 0; c < contacts.size(); ++c) {
    for (const int node : block.sites.sites[contacts[c].site].patch_nodes) {
      const Eigen::Vector3d moved =
          Eigen::Vector3d(contacts[c].displacement) + arm_of(c, node, true) - arm_of(c, node, false);
      for (int axis = 0; axis < 3 && !is_fixed(node); ++axis) {
        const Eigen::Index dof = 3 * node + axis;
        if (load.held[static_cast<size_t>(dof)] == 0) load.displacement[dof] = u0[dof];
        load.held[static_cast<size_t>(dof)] = 1;
        load.displacement[dof] += moved[axis] / holders[static_cast<size_t>(node)];
      }
    }
  }
  StaticSolver solver(assembly);
  Eigen::VectorXd u = u0;
  SolverSettings settings;
  settings.residual_tolerance = 1e-12;
  if (!solver.ramp(at_rest, load, u, settings).converged) throw std::runtime_error("the full solve failed");
  Eigen::VectorXd internal;
  ContactAnswer truth;
  truth.min_jacobian = assembly.internal_force(u, internal).min_jacobian;
  Eigen::VectorXd outside = internal - at_rest.force;
  truth.field = packed_rows(block.sites, u);
  for (size_t c = 0; c < contacts.size(); ++c) {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();
    for (const int node : block.sites.sites[contacts[c].site].patch_nodes) {
      if (is_fixed(node)) continue;
      const Eigen::Vector3d own = outside.segment<3>(3 * node) / holders[static_cast<size_t>(node)];
      force += own;
      torque += arm_of(c, node, true).cross(own);
    }
    truth.forces.push_back(force);
    truth.torques.push_back(torque);
  }
  return truth;
}

// A block whose zone has `rings` rings. Eight rings hold the whole block.
struct ZoneBlock {
  ZoneBlock(int rings, const Law& law, bool quadratic = false,
            const Eigen::Vector3d& gravity = Eigen::Vector3d::Zero(), int cells = 4, double tip_radius = 0.26,
            bool shares_volumes = false)
      : ZoneBlock(rings, made_of(law, quadratic, gravity, cells, tip_radius, shares_volumes)) {}
  ZoneBlock(int rings, TouchedBlock touched) : block(std::move(touched)) {
    block.scene.accuracy_target = 1e-5;
    zone = find_zones(block.model, block.sites, rings);
    PackContent content{block.model, block.scene, block.sites, &linear, nullptr, false, {}, {}, &rest};
    content.zone = &zone;
    bytes.emplace(write_pack(content));
    pack.emplace(*bytes);
  }

  ContactAnswer solve(const std::vector<pal_contact>& contacts, const std::vector<int>& fixed = {},
                      const std::vector<Eigen::Matrix3d>& rotations = {}) const {
    return solve_contacts(block, assembly, rest, contacts, fixed, rotations);
  }

  pal_session_config config(uint32_t max_contacts, uint32_t rings = 0) const {
    pal_session_config config = session_config(pack->get(), PAL_MODEL_ZONE, max_contacts, 0);
    config.zone_rings = rings;
    return config;
  }

  TouchedBlock block;
  Assembly assembly{block.model, block.model.fixed_dofs()};
  RestState rest = find_rest(assembly, block.scene);
  LinearDd linear = compute_linear_dd(assembly, block.sites, {}, rest);
  ZoneTables zone;
  std::optional<AlignedBytes> bytes;
  std::optional<OpenPack> pack;

 private:
  static TouchedBlock made_of(const Law& law, bool quadratic, const Eigen::Vector3d& gravity, int cells,
                              double tip_radius, bool shares_volumes) {
    TouchedBlock block = touched_block(cells, tip_radius, quadratic);
    if (shares_volumes) form_volume_patches(block.model, std::vector<int>(block.model.elements.size(), 0));
    block.model.materials.front().law = law;
    block.model.materials.front().density = 1.0;
    if (gravity.norm() > 0) block.scene.gravity = gravity;
    show_every_node(block);
    return block;
  }
};

inline constexpr CompressibleNeoHookean kTissue = {1.0, 4.0};

// The kTissue block with these arguments, built once a process.
inline const ZoneBlock& tissue_block(int rings, bool quadratic = false,
                                     const Eigen::Vector3d& gravity = Eigen::Vector3d::Zero(), int cells = 4,
                                     double tip_radius = 0.26, bool shares_volumes = false) {
  using Key = std::tuple<int, bool, std::array<double, 3>, int, double, bool>;
  static std::map<Key, std::unique_ptr<ZoneBlock>> blocks;
  std::unique_ptr<ZoneBlock>& block =
      blocks[{rings, quadratic, {gravity[0], gravity[1], gravity[2]}, cells, tip_radius, shares_volumes}];
  if (!block)
    block =
        std::make_unique<ZoneBlock>(rings, kTissue, quadratic, gravity, cells, tip_radius, shares_volumes);
  return *block;
}

// Moves to `contacts` in steps, as a tool would.
inline std::vector<pal_contact_result> move_to(OwnedSession& session,
                                               const std::vector<pal_contact>& contacts, bool refines = true,
                                               uint64_t slice = 0) {
  std::vector<pal_contact_result> results;
  for (int step = 1; step <= 10; ++step) {
    std::vector<pal_contact> on_the_way = contacts;
    for (pal_contact& contact : on_the_way) {
      for (double& d : contact.displacement) d *= step / 10.0;
      for (double& force : contact.force) force *= step / 10.0;
    }
    results = session.touch(on_the_way);
    if (refines) refine(session, slice);
  }
  return results;
}

// Moves to `contacts` and holds them until frames and iterations have converged.
inline std::vector<pal_contact_result> settle(OwnedSession& session, const std::vector<pal_contact>& contacts,
                                              uint64_t slice = 0) {
  std::vector<pal_contact_result> results = move_to(session, contacts, true, slice);
  double change = 1;
  for (int frame = 0; frame < 60 && change > 1e-14; ++frame) {
    results = session.touch(contacts);
    const pal_refinement refinement = refine(session, slice);
    change = refinement.failed != 0 ? 1 : refinement.change;
  }
  for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame) results = session.touch(contacts);
  return results;
}

// The same, of first order outside of the zones.
inline std::vector<pal_contact_result> settle_unrefined(OwnedSession& session,
                                                        const std::vector<pal_contact>& contacts) {
  std::vector<pal_contact_result> results = move_to(session, contacts, false);
  for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame) results = session.touch(contacts);
  return results;
}

// Field error over the longest displacement, force error over the largest force.
struct ZoneErrors {
  double field = 0;
  double force = 0;
};

// Errors against the full solve at the session's current displacements, prescribed or free.
inline ZoneErrors errors_where_it_is(const ZoneBlock& organ, OwnedSession& session,
                                     std::vector<pal_contact> contacts,
                                     const std::vector<pal_contact_result>& results,
                                     const std::vector<int>& fixed = {}) {
  double push = 0;
  for (size_t c = 0; c < contacts.size(); ++c) {
    EXPECT_EQ(results[c].model, PAL_MODEL_ZONE);
    EXPECT_EQ(results[c].flags & PAL_FLAG_UNCONVERGED, 0U);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const double moved = results[c].displacement[axis];
      const bool is_given = (contacts[c].force_axes >> axis & 1) == 0;
      EXPECT_NEAR(moved, is_given ? contacts[c].displacement[axis] : moved, 1e-12);
      contacts[c].displacement[axis] = moved;
    }
    push = std::max(push, Eigen::Vector3d(results[c].displacement).norm());
  }
  const ContactAnswer truth = organ.solve(contacts, fixed);
  ZoneErrors errors;
  double largest = 0;
  for (size_t c = 0; c < contacts.size(); ++c) {
    largest = std::max(largest, truth.forces[c].norm());
    errors.force = std::max(errors.force, (Eigen::Vector3d(results[c].force) - truth.forces[c]).norm());
  }
  errors.field = (as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>() / push;
  errors.force /= largest;
  return errors;
}

// The contact nodes among the model's `nodes`, in the session's numbering.
inline std::vector<uint32_t> contact_nodes_at(const ZoneBlock& organ, const std::vector<int>& nodes) {
  std::vector<uint32_t> found;
  for (uint32_t i = 0; i < organ.block.sites.contact_nodes.size(); ++i) {
    const int node = organ.block.sites.model_node(static_cast<int>(i));
    if (std::find(nodes.begin(), nodes.end(), node) != nodes.end()) found.push_back(i);
  }
  return found;
}

// Whether contacts have reached their targets and converged. All contacts of a zone report the same flags.
inline bool has_ended(const std::vector<pal_contact_result>& results) {
  return (results.front().flags & PAL_FLAG_UNCONVERGED) == 0;
}

inline double largest_force(const std::vector<pal_contact_result>& results) {
  double largest = 0;
  for (const pal_contact_result& result : results)
    largest = std::max(largest, Eigen::Vector3d(result.force).norm());
  return largest;
}

// Largest force error over the largest force.
inline double worst_force_error(const std::vector<pal_contact_result>& found,
                                const std::vector<pal_contact_result>& expected) {
  double worst = 0;
  for (size_t c = 0; c < found.size(); ++c)
    worst = std::max(worst, (Eigen::Vector3d(found[c].force) - Eigen::Vector3d(expected[c].force)).norm());
  return worst / largest_force(expected);
}

// A pack of the same organ with other zone tables.
inline AlignedBytes pack_of(const ZoneBlock& organ, const ZoneTables& zone) {
  PackContent content{
      organ.block.model, organ.block.scene, organ.block.sites, &organ.linear, nullptr, false, {}, {},
      &organ.rest};
  content.zone = &zone;
  return write_pack(content);
}

// Largest component of the pack's field error after the contacts have settled.
inline double field_error(const ZoneBlock& organ, const pal_pack* pack,
                          const std::vector<pal_contact>& contacts) {
  OwnedSession session(pack, session_config(pack, PAL_MODEL_ZONE, static_cast<uint32_t>(contacts.size()), 0));
  settle(session, contacts);
  return (as_vector(session.field()) - organ.solve(contacts).field).lpNorm<Eigen::Infinity>();
}

}  // namespace palpate::test
