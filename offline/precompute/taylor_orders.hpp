// Orders of the internal force along paths from rest, a_1 t + a_2 t^2 + ..., one for each of some rays.
//
// With c_j the coefficient of t^j in P of the path up to a_(j-1), equilibrium asks for K a_j = -c_j: the perturbation
// method (Damil and Potier-Ferry 1990, A new method to compute perturbed bifurcations). c_j comes from differences of
// P: even orders from P(t) + P(-t), odd ones from P(t) - P(-t), at two t for Richardson's extrapolation, longer ones
// the higher the order. What holds for rays holds for all of space: a form of degree j in three variables is known from
// its values along (j + 1) (j + 2) / 2 of them.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "offline/fem/assembly.hpp"

namespace palpate {

// As many as determine forms of this degree, and a few to spare.
int num_rays(int degree);

// So many directions over half of the sphere, in columns: along -r an order is what it is along r, but for its sign.
Eigen::Matrix3Xd ray_directions(int count);

// c_j of `order` j: num_dofs x rays. `path`: a_1 .. a_(j-1), of which a_1 moves the body by a mean surface edge or
// less; `lower`: the lower orders of P of the path up to there, K a_1 the first. None where an element inverts within
// 0.08 of the path. Cost: four evaluations of P a ray.
std::optional<Eigen::MatrixXd> internal_force_of_order(const Assembly& assembly,
                                                       const Eigen::VectorXd& at_rest,
                                                       const std::vector<Eigen::MatrixXd>& path,
                                                       const std::vector<Eigen::MatrixXd>& lower, int order);

// Coefficients of the monomials of `degree`, in the order of a pack, of forms with these values along the rays (rows):
// monomials x forms. At least (degree + 1) (degree + 2) / 2 rays.
Eigen::MatrixXd forms_along_rays(const Eigen::Matrix3Xd& directions, int degree,
                                 const Eigen::MatrixXd& values);

}  // namespace palpate
