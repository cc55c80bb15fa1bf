// Pressure on faces, following them as they move.
//
// Source: Zhong et al. 2005 eqs. (7) to (9) with the traction -p n of the current configuration; for the
// tangent Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, section 9.5. With the
// tangents g_xi = dx/dxi and g_eta = dx/deta of a face, whose cross product is n dA and points outwards,
//   f_a       = - p sum_q w N_a g_xi x g_eta
//   df_a/dx_b = - p sum_q w N_a (dN_b/deta [g_xi]x - dN_b/dxi [g_eta]x),    [v]x d = v x d
// The tangent is symmetric but for terms on the rim of a loaded patch, where that is free.
#pragma once

#include <Eigen/Core>
#include <map>

#include "offline/fem/assembly.hpp"

namespace palpate {

using FacePressures = std::map<FaceId, double>;  // force unit / length unit^2, pushing into the element

// Adds the nodal forces of the pressures to `force`, both of num_dofs.
void add_pressure_force(const Model& model, const FacePressures& pressures,
                        const Eigen::VectorXd& displacement, Eigen::VectorXd& force);

// Takes the symmetric part of their tangent from `stiffness`, which has the pattern of `assembly`.
void subtract_pressure_tangent(const Assembly& assembly, const FacePressures& pressures,
                               const Eigen::VectorXd& displacement, Assembly::SparseLower& stiffness);

// Takes their whole tangent, times `vector`, from `product`, both of num_dofs.
void subtract_pressure_product(const Model& model, const FacePressures& pressures,
                               const Eigen::VectorXd& displacement, const Eigen::VectorXd& vector,
                               Eigen::VectorXd& product);

// The work of the pressures along the straight way from `displacement` to `displacement + step`. Their forces
// are quadratic in the position of a face: Simpson's rule is exact.
double pressure_work(const Model& model, const FacePressures& pressures, const Eigen::VectorXd& displacement,
                     const Eigen::VectorXd& step);

}  // namespace palpate
