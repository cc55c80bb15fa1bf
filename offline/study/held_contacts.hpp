// The common problem of all linear methods: a linear body at rest, k contacts with displacement d. With free
// equations f, contact equations c, and rigid patches:
//   K_ff u_f = -K_fc d,   force on the contacts K_cf u_f + K_cc d.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <palpate/palpate.hpp>
#include <vector>

#include "offline/fem/assembly.hpp"

namespace palpate {

using Sparse = Eigen::SparseMatrix<double, Eigen::RowMajor, int>;
using SparseColumns = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;
// Displacements in the runtime's precision.
using RealMatrix = Eigen::Matrix<pal_real, Eigen::Dynamic, Eigen::Dynamic>;
using RealVector = Eigen::Matrix<pal_real, Eigen::Dynamic, 1>;

struct HeldContacts {
  Sparse free_free;
  SparseColumns free_contact;
  Eigen::MatrixXd contact_contact;
  std::vector<int> free_dofs;  // dofs of the model

  // Contacts of one node each; `nodes`: of the model, with three free dofs each.
  HeldContacts(const Assembly& assembly, const std::vector<int>& nodes)
      : HeldContacts(assembly, patches_of(nodes), Eigen::VectorXd::Zero(assembly.num_dofs())) {}

  // `patches`: disjoint sets of nodes of the model, with three free dofs each; `rest`: all dofs.
  HeldContacts(const Assembly& assembly, const std::vector<std::vector<int>>& patches,
               const Eigen::VectorXd& rest) {
    SparseLower lower;
    assembly.tangent(rest, false, lower);
    const Sparse all = lower.selfadjointView<Eigen::Lower>();
    const int num_contact = 3 * static_cast<int>(patches.size());
    std::vector<int> place(static_cast<size_t>(all.rows()), -1);  // place of an equation; contact c is -2 - c
    for (size_t contact = 0; contact < patches.size(); ++contact) {
      for (const int node : patches[contact]) {
        for (int axis = 0; axis < 3; ++axis)
          place[static_cast<size_t>(assembly.dof_equations()[static_cast<size_t>(3 * node + axis)])] =
              -2 - static_cast<int>(3 * contact) - axis;
      }
    }
    for (size_t equation = 0; equation < place.size(); ++equation) {
      if (place[equation] != -1) continue;
      place[equation] = static_cast<int>(free_dofs.size());
      free_dofs.push_back(assembly.equation_dofs()[equation]);
    }
    const int num_free = static_cast<int>(free_dofs.size());
    std::vector<Eigen::Triplet<double>> of_free;
    std::vector<Eigen::Triplet<double>> of_contact;
    contact_contact = Eigen::MatrixXd::Zero(num_contact, num_contact);
    for (int row = 0; row < all.outerSize(); ++row) {
      const int i = place[static_cast<size_t>(row)];
      for (Sparse::InnerIterator it(all, row); it; ++it) {
        const int j = place[static_cast<size_t>(it.col())];
        if (i >= 0 && j >= 0) of_free.emplace_back(i, j, it.value());
        if (i >= 0 && j < 0) of_contact.emplace_back(i, -2 - j, it.value());
        if (i < 0 && j < 0) contact_contact(-2 - i, -2 - j) += it.value();
      }
    }
    free_free.resize(num_free, num_free);
    free_free.setFromTriplets(of_free.begin(), of_free.end());
    free_contact.resize(num_free, num_contact);
    free_contact.setFromTriplets(of_contact.begin(), of_contact.end());
  }

  Eigen::VectorXd force(const Eigen::VectorXd& free, const Eigen::VectorXd& d) const {
    return free_contact.transpose() * free + contact_contact * d;
  }

 private:
  static std::vector<std::vector<int>> patches_of(const std::vector<int>& nodes) {
    std::vector<std::vector<int>> patches;
    for (const int node : nodes) patches.push_back({node});
    return patches;
  }
};

}  // namespace palpate
