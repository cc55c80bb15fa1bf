// An organ with the linear pack of its scene, a session on the pack, and an exact reference.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <palpate/palpate.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

#include "bench/peers/back_solve.hpp"
#include "bench/peers/frame_times.hpp"
#include "offline/pack/pack_writer.hpp"
#include "offline/precompute/linear_dd.hpp"

namespace palpate::peers {

inline void require(pal_status status) {
  if (status != PAL_STATUS_OK) throw std::runtime_error(pal_status_text(status));
}

struct LinearOrgan {
  Model model;
  Scene scene;
  Assembly assembly;
  double pack_seconds = 0;  // build time of the pack
  ContactSites sites;
  AlignedBytes pack{0};

  explicit LinearOrgan(LoadedScene loaded)
      : model(std::move(loaded.model)), scene(std::move(loaded.scene)), assembly(model, model.fixed_dofs()) {
    const double start = now();
    sites = find_contact_sites(scene, model);
    const LinearDd linear = compute_linear_dd(assembly, sites);
    pack = write_pack({model, scene, sites, &linear, nullptr, 0, {}, {}});
    pack_seconds = now() - start;
  }
  LinearOrgan(const LinearOrgan&) = delete;  // the assembly refers to the model
  LinearOrgan& operator=(const LinearOrgan&) = delete;

  int site_node(std::uint32_t site) const { return sites.sites[site].node; }
  std::uint32_t num_sites() const { return static_cast<std::uint32_t>(sites.sites.size()); }
  Eigen::Index num_shown() const { return static_cast<Eigen::Index>(sites.packed_nodes.size()); }
};

inline std::vector<pal_contact> contacts_at(const std::vector<std::uint32_t>& sites) {
  std::vector<pal_contact> contacts(sites.size());
  for (size_t c = 0; c < sites.size(); ++c) contacts[c].site = sites[c];
  return contacts;
}

// Sets the contacts' displacements to d, three numbers a contact.
inline void displace(const Eigen::VectorXd& d, std::vector<pal_contact>& contacts) {
  for (size_t i = 0; i < 3 * contacts.size(); ++i)
    contacts[i / 3].displacement[i % 3] = d[static_cast<Eigen::Index>(i)];
}

// A session of linear_dd on the pack of an organ.
class LinearSession {
 public:
  LinearSession(const LinearOrgan& organ, std::uint32_t max_contacts)
      : field_(3 * organ.num_shown()), results_(max_contacts) {
    require(pack_.open_memory(organ.pack.bytes().data(), organ.pack.bytes().size()));
    pal_session_config config = pal_default_session_config(pack_.get());
    config.max_contacts = max_contacts;
    size_t bytes = 0;
    require(Session::required_bytes(pack_, config, bytes));
    arena_.emplace(bytes);
    require(session_.init(pack_, config, arena_->bytes()));
  }

  void contact_frame(const std::vector<pal_contact>& contacts) {
    require(session_.contact_frame(contacts, {results_.data(), contacts.size()}));
  }
  void visual_frame() { require(session_.visual_frame(field_.data())); }

  // Returns the contacts' forces of the last frame.
  Eigen::VectorXd force(size_t num_contacts) const {
    Eigen::VectorXd force(static_cast<Eigen::Index>(3 * num_contacts));
    for (size_t c = 0; c < num_contacts; ++c)
      force.segment<3>(static_cast<Eigen::Index>(3 * c)) = Eigen::Vector3d(results_[c].force);
    return force;
  }
  const RealVector& field() const { return field_; }

 private:
  Pack pack_;
  std::optional<AlignedBytes> arena_;
  Session session_;
  RealVector field_;  // 3 packed nodes
  std::vector<pal_contact_result> results_;
};

// The reference: a float64 solve with these nodes held. Only the stiffness at rest is that of the pack.
struct ExactAnswer {
  Eigen::VectorXd displacement;  // 3 nodes of the model
  Eigen::VectorXd force;         // 3 contacts

  ExactAnswer(const Assembly& assembly, const std::vector<int>& nodes, const Eigen::VectorXd& d)
      : displacement(Eigen::VectorXd::Zero(assembly.num_dofs())) {
    const HeldContacts held(assembly, nodes);
    BackSolve solve(held);
    const Eigen::VectorXd& free = solve.frame(d);
    force = held.force(free, d);
    displacement(held.free_dofs) = free;
    for (size_t c = 0; c < nodes.size(); ++c)
      displacement.segment<3>(3 * nodes[c]) = d.segment<3>(static_cast<Eigen::Index>(3 * c));
  }
  Eigen::VectorXd shown(const ContactSites& sites) const {
    Eigen::VectorXd values(static_cast<Eigen::Index>(3 * sites.packed_nodes.size()));
    for (size_t i = 0; i < sites.packed_nodes.size(); ++i)
      values.segment<3>(static_cast<Eigen::Index>(3 * i)) =
          displacement.segment<3>(static_cast<Eigen::Index>(3 * sites.packed_nodes[i]));
    return values;
  }
};

inline double longest(const Eigen::VectorXd& vectors) {
  return std::sqrt(vectors.reshaped(3, vectors.size() / 3).colwise().squaredNorm().maxCoeff());
}

struct Errors {
  double displacement = 0;  // largest |u - u_exact| of a node over largest |d| of a contact
  double force = 0;         // |f - f_exact| / |f_exact|, f of all contacts together

  void add(const Eigen::VectorXd& displacement_error, const Eigen::VectorXd& d,
           const Eigen::VectorXd& force_error, const Eigen::VectorXd& exact_force) {
    displacement = std::max(displacement, longest(displacement_error) / longest(d));
    force = std::max(force, force_error.norm() / exact_force.norm());
  }
};

}  // namespace palpate::peers
