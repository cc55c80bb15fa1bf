// Reference linear response: a dense float64 solve of the whole stiffness. It shares no code with linear_dd.
//
// Held dofs c have displacements u_c, free dofs f carry no load:
//   K_ff u_f = -K_fc u_c,   forces f_c = K_cf u_f + K_cc u_c.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <map>
#include <vector>

#include "offline/fem/assembly.hpp"
#include "offline/numerics/decompositions.hpp"
#include "offline/precompute/contact_sites.hpp"

namespace palpate::test {

class DenseReference {
 public:
  // K at rest. Rows and columns of the model's fixed dofs keep only a diagonal 1.
  DenseReference(const Assembly& assembly, const ContactSites& sites) : sites_(&sites) {
    Assembly::SparseLower lower;
    assembly.tangent(Eigen::VectorXd::Zero(assembly.num_dofs()), false, lower);
    const Eigen::MatrixXd equations = Eigen::MatrixXd(lower).selfadjointView<Eigen::Lower>();
    stiffness_ = Eigen::MatrixXd::Identity(assembly.num_dofs(), assembly.num_dofs());
    const std::vector<int>& dofs = assembly.equation_dofs();
    stiffness_(dofs, dofs) = equations;
  }

  // Model node -> displacement.
  using Held = std::map<int, Eigen::Vector3d>;

  struct Answer {
    Eigen::VectorXd field;  // all dofs of the model
    Eigen::VectorXd force;  // all dofs of the model, nonzero at held nodes
  };

  Answer solve(const Held& held) const {
    std::vector<Eigen::Index> fixed_dofs;
    std::vector<Eigen::Index> free_dofs;
    Answer answer;
    answer.field = Eigen::VectorXd::Zero(stiffness_.rows());
    for (Eigen::Index dof = 0; dof < stiffness_.rows(); ++dof) {
      const auto node = held.find(static_cast<int>(dof / 3));
      (node == held.end() ? free_dofs : fixed_dofs).push_back(dof);
      if (node != held.end()) answer.field[dof] = node->second[dof % 3];
    }
    const Eigen::VectorXd load = -stiffness_(free_dofs, fixed_dofs) * answer.field(fixed_dofs);
    answer.field(free_dofs) = solve_definite(stiffness_(free_dofs, free_dofs), load);
    answer.force = Eigen::VectorXd::Zero(stiffness_.rows());
    answer.force(fixed_dofs) = stiffness_(fixed_dofs, Eigen::all) * answer.field;
    return answer;
  }

  // Displacements that contacts and fixed nodes prescribe. A node of several patches takes their mean.
  Held hold(const std::vector<std::pair<size_t, Eigen::Vector3d>>& contacts,
            const std::vector<int>& fixed) const {
    std::map<int, int> holders;
    Held held;
    for (const auto& [site, d] : contacts) {
      for (const int node : sites_->sites[site].patch_nodes) {
        ++holders[node];
        held.try_emplace(node, Eigen::Vector3d::Zero()).first->second += d;
      }
    }
    for (auto& [node, displacement] : held) displacement /= holders[node];
    for (const int node : fixed) held[node] = Eigen::Vector3d::Zero();
    return held;
  }

  // Force on the tool at `site`, by virtual work: a node that m tools share passes 1/m of its force to each
  // tool.
  Eigen::Vector3d tool_force(const std::vector<std::pair<size_t, Eigen::Vector3d>>& contacts, size_t contact,
                             const std::vector<int>& fixed, const Answer& answer) const {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (const int node : sites_->sites[contacts[contact].first].patch_nodes) {
      if (std::find(fixed.begin(), fixed.end(), node) != fixed.end()) continue;
      int holders = 0;
      for (const auto& other : contacts) {
        const std::vector<int>& patch = sites_->sites[other.first].patch_nodes;
        holders += std::count(patch.begin(), patch.end(), node) > 0 ? 1 : 0;
      }
      force += answer.force.segment<3>(3 * node) / holders;
    }
    return force;
  }

  // The rows of packed nodes.
  Eigen::VectorXd packed(const Eigen::VectorXd& all) const {
    Eigen::VectorXd rows(3 * static_cast<Eigen::Index>(sites_->packed_nodes.size()));
    for (size_t i = 0; i < sites_->packed_nodes.size(); ++i)
      rows.segment<3>(3 * static_cast<Eigen::Index>(i)) = all.segment<3>(3 * sites_->packed_nodes[i]);
    return rows;
  }

 private:
  const ContactSites* sites_;
  Eigen::MatrixXd stiffness_;
};

}  // namespace palpate::test
