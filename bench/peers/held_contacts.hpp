// The common problem of all linear methods: a linear body at rest with k contacts of one node each, displaced
// by d. With free equations f and contact equations c:
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
  Sparse free_free;                 // K_ff
  SparseColumns free_contact;       // K_fc
  Eigen::MatrixXd contact_contact;  // K_cc
  std::vector<int> free_dofs;       // the model's dof of each free equation

  // `nodes`: the contacts, nodes of the model with three free dofs each.
  HeldContacts(const Assembly& assembly, const std::vector<int>& nodes) {
    SparseLower lower;
    assembly.tangent(Eigen::VectorXd::Zero(assembly.num_dofs()), false, lower);
    const Sparse stiffness = lower.selfadjointView<Eigen::Lower>();
    const int num_contact = 3 * static_cast<int>(nodes.size());
    std::vector<int> index_of(static_cast<size_t>(stiffness.rows()), -1);  // in f; -2 - c for contact dof c
    for (int c = 0; c < num_contact; ++c) {
      const int dof = 3 * nodes[static_cast<size_t>(c / 3)] + c % 3;
      index_of[static_cast<size_t>(assembly.dof_equations()[static_cast<size_t>(dof)])] = -2 - c;
    }
    for (size_t equation = 0; equation < index_of.size(); ++equation) {
      if (index_of[equation] != -1) continue;
      index_of[equation] = static_cast<int>(free_dofs.size());
      free_dofs.push_back(assembly.equation_dofs()[equation]);
    }
    const int num_free = static_cast<int>(free_dofs.size());
    std::vector<Eigen::Triplet<double>> free_free_entries;
    std::vector<Eigen::Triplet<double>> free_contact_entries;
    contact_contact = Eigen::MatrixXd::Zero(num_contact, num_contact);
    for (int row = 0; row < stiffness.outerSize(); ++row) {
      const int i = index_of[static_cast<size_t>(row)];
      for (Sparse::InnerIterator it(stiffness, row); it; ++it) {
        const int j = index_of[static_cast<size_t>(it.col())];
        if (i >= 0 && j >= 0) free_free_entries.emplace_back(i, j, it.value());
        if (i >= 0 && j < 0) free_contact_entries.emplace_back(i, -2 - j, it.value());
        if (i < 0 && j < 0) contact_contact(-2 - i, -2 - j) += it.value();
      }
    }
    free_free.resize(num_free, num_free);
    free_free.setFromTriplets(free_free_entries.begin(), free_free_entries.end());
    free_contact.resize(num_free, num_contact);
    free_contact.setFromTriplets(free_contact_entries.begin(), free_contact_entries.end());
  }

  // Returns K_cf u_f + K_cc d.
  Eigen::VectorXd force(const Eigen::VectorXd& free, const Eigen::VectorXd& d) const {
    return free_contact.transpose() * free + contact_contact * d;
  }
};

}  // namespace palpate::peers
