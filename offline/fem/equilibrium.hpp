// Functions that all equilibrium solvers share: the residual, and the treatment of held dofs and pressures in
// the linear equations.
//
// Source: Zhong et al. 2005 eq. (6), Phi(u) = f_ext(u) - P(u). Vectors of num_dofs entries, force and length
// unit of the model.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "offline/fem/assembly.hpp"
#include "offline/fem/load_case.hpp"

namespace palpate {

// f_ext(u): forces and pressures.
Eigen::VectorXd external_force(const Model& model, const LoadCase& load, const Eigen::VectorXd& displacement);

// Sets entries of held dofs and of dofs without an equation to 0.
void clear_held(const Assembly& assembly, const LoadCase& load, Eigen::VectorXd& vector);

// f_ext - P over the free dofs; 0 elsewhere.
Eigen::VectorXd out_of_balance(const Assembly& assembly, const LoadCase& load,
                               const Eigen::VectorXd& internal, const Eigen::VectorXd& external);

// Force scale: |P| over the held dofs plus |f_ext| over the free dofs, 2-norms.
double force_scale(const Assembly& assembly, const LoadCase& load, const Eigen::VectorXd& internal,
                   const Eigen::VectorXd& external);

// For each equation: whether `load` holds its dof.
std::vector<char> held_equations(const Assembly& assembly, const LoadCase& load);

// Replaces the rows of held equations by x = 0: clears row and column, keeps the diagonal as scale.
void hold_equations(const std::vector<char>& held, SparseLower& stiffness);

// Solves (K - K_p) x = b over the free dofs, 0 elsewhere, in place of b. K_p is the unsymmetric tangent of
// the pressures. GMRES stops at 1e-6, enough for Newton's next residual. `precondition` replaces a vector v
// by about K^-1 v and returns success. False, with b unchanged, without convergence.
[[nodiscard]] bool solve_with_pressures(const Assembly& assembly, const LoadCase& load,
                                        const Eigen::VectorXd& displacement,
                                        const std::function<bool(Eigen::VectorXd&)>& precondition,
                                        Eigen::VectorXd& b);

}  // namespace palpate
