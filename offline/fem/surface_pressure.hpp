// Pressure on faces; the pressure follows the moving faces.
//
// Source: Zhong et al. 2005 eqs. (7) to (9) with the traction -p n of the current configuration; tangent:
// Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, section 9.5. With the
// tangents g_xi = dx/dxi and g_eta = dx/deta of a face, whose cross product is n dA and points outwards,
//   f_a       = - p sum_q w N_a g_xi x g_eta
//   df_a/dx_b = - p sum_q w N_a (dN_b/deta [g_xi]x - dN_b/dxi [g_eta]x),    [v]x d = v x d
// The tangent is symmetric except at a free rim of a loaded patch.
#pragma once

#include <Eigen/Core>
#include <map>

#include "offline/fem/assembly.hpp"

namespace palpate {

using FacePressures = std::map<FaceId, double>;  // force unit / length unit^2, pushes into the element

// Adds the nodal forces of the pressures to `force`, both of num_dofs.
void add_pressure_force(const Model& model, const FacePressures& pressures,
                        const Eigen::VectorXd& displacement, Eigen::VectorXd& force);

// Subtracts the symmetric part of the pressures' tangent from `stiffness`, a matrix of assembly.tangent().
void subtract_pressure_tangent(const Assembly& assembly, const FacePressures& pressures,
                               const Eigen::VectorXd& displacement, Assembly::SparseLower& stiffness);

// Subtracts the pressures' tangent times `vector` from `product`, both of num_dofs.
void subtract_pressure_product(const Model& model, const FacePressures& pressures,
                               const Eigen::VectorXd& displacement, const Eigen::VectorXd& vector,
                               Eigen::VectorXd& product);

// Returns the work of the pressures along the straight line from `displacement` to `displacement + step`.
// Simpson's rule is exact: the forces are quadratic in a face's position.
double pressure_work(const Model& model, const FacePressures& pressures, const Eigen::VectorXd& displacement,
                     const Eigen::VectorXd& step);

}  // namespace palpate
