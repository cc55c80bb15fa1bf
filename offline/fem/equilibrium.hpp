// What is out of balance in a state, and how held degrees of freedom and pressures enter its linear equations:
// what every way to an equilibrium shares.
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

// Sets what is held, or has no equation of its own, to 0.
void clear_held(const Assembly& assembly, const LoadCase& load, Eigen::VectorXd& vector);

// f_ext - P over the free dofs, else 0.
Eigen::VectorXd out_of_balance(const Assembly& assembly, const LoadCase& load,
                               const Eigen::VectorXd& internal, const Eigen::VectorXd& external);

// The force at play: |P| over the held dofs plus |f_ext| over the free ones, 2-norms.
double force_scale(const Assembly& assembly, const LoadCase& load, const Eigen::VectorXd& internal,
                   const Eigen::VectorXd& external);

// Whether each equation is of a dof that `load` holds.
std::vector<char> held_equations(const Assembly& assembly, const LoadCase& load);

// Makes the rows of held equations x = 0: row and column are cleared, the diagonal stays as the scale.
void hold_equations(const std::vector<char>& held, SparseLower& stiffness);

// Replaces b by x of (K - K_p) x = b over the free dofs, 0 else, with the whole unsymmetric tangent K_p of the
// pressures, by GMRES to 1e-6: Newton's next residual is not that far below this one. `precondition` replaces
// a vector by about K^-1 times it and says whether it could. False, b as it was, where that does not converge.
[[nodiscard]] bool solve_with_pressures(const Assembly& assembly, const LoadCase& load,
                                        const Eigen::VectorXd& displacement,
                                        const std::function<bool(Eigen::VectorXd&)>& precondition,
                                        Eigen::VectorXd& b);

}  // namespace palpate
