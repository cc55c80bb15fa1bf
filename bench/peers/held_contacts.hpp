// The common problem of all linear methods: a linear body at rest, k contacts of one node each, with displacement d.
// With free equations f and contact equations c:
//   K_ff u_f = -K_fc d,   force on the contacts K_cf u_f + K_cc d.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <palpate/palpate.hpp>
#include <vector>

#include "offline/fem/assembly.hpp"

namespace palpate::peers {

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

  // `nodes`: of the model, with three free dofs each.
  HeldContacts(const Assembly& assembly, const std::vector<int>& nodes) {
    SparseLower lower;
    assembly.tangent(Eigen::VectorXd::Zero(assembly.num_dofs()), false, lower);
    const Sparse all = lower.selfadjointView<Eigen::Lower>();
    const int num_contact = 3 * static_cast<int>(nodes.size());
    std::vector<int> place(static_cast<size_t>(all.rows()), -1);  // place of an equation; contact c is -2 - c
    for (int c = 0; c < num_contact; ++c) {
      const int dof = 3 * nodes[static_cast<size_t>(c / 3)] + c % 3;
      place[static_cast<size_t>(assembly.dof_equations()[static_cast<size_t>(dof)])] = -2 - c;
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
};

}  // namespace palpate::peers
