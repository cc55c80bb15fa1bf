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

// Returns f_ext(u): the nodal forces of `load`, pressures included.
Eigen::VectorXd external_force(const Model& model, const LoadCase& load, const Eigen::VectorXd& displacement);

// Sets entries of held dofs and of dofs without an equation to 0.
void clear_held(const Assembly& assembly, const LoadCase& load, Eigen::VectorXd& vector);

// Returns f_ext - P at the free dofs, and 0 at the other dofs.
Eigen::VectorXd out_of_balance(const Assembly& assembly, const LoadCase& load,
                               const Eigen::VectorXd& internal, const Eigen::VectorXd& external);

// Returns the force scale: |P| over the held dofs plus |f_ext| over the free dofs, 2-norms.
double force_scale(const Assembly& assembly, const LoadCase& load, const Eigen::VectorXd& internal,
                   const Eigen::VectorXd& external);

// Returns for each equation whether `load` holds its dof.
std::vector<char> held_equations(const Assembly& assembly, const LoadCase& load);

// Replaces held equations by x = 0: clears their rows and columns and keeps the diagonal.
void hold_equations(const std::vector<char>& held, SparseLower& stiffness);

// Replaces b by x with (K - K_p) x = b at the free dofs and x = 0 at the others. K_p is the unsymmetric
// tangent of the pressures. GMRES stops at 1e-6, enough for Newton's next residual. `precondition` replaces a
// vector v by about K^-1 v and returns success. Returns false, with b unchanged, without convergence.
[[nodiscard]] bool solve_with_pressures(const Assembly& assembly, const LoadCase& load,
                                        const Eigen::VectorXd& displacement,
                                        const std::function<bool(Eigen::VectorXd&)>& precondition,
                                        Eigen::VectorXd& b);

}  // namespace palpate
