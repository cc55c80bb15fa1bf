// Orders of the internal force along paths a_1 t + a_2 t^2 + ... from rest, one path for each ray.
//
// With c_j the coefficient of t^j in P of the path up to a_(j-1), equilibrium requires K a_j = -c_j: the
// asymptotic numerical method (Damil and Potier-Ferry 1990, A new method to compute perturbed bifurcations).
// Even c_j follow from P(t) + P(-t), odd c_j from P(t) - P(-t), at two t for Richardson's extrapolation.
// Values along (j + 1) (j + 2) / 2 rays determine a form of degree j in three variables.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "offline/fem/assembly.hpp"

namespace palpate {

// Returns a number of rays that determines forms of this degree, with a few rays to spare.
int num_rays(int degree);

// Returns `count` directions over half of the sphere, as columns: orders along -r differ only in sign.
Eigen::Matrix3Xd ray_directions(int count);

// Returns c_j of `order` j: num_dofs x rays. `path`: a_1 .. a_(j-1), where a_1 moves the body by at most a
// mean surface edge. `lower`: the lower orders of P of the path, first K a_1. Empty where an element inverts
// for |t| up to 0.08. Cost: four evaluations of P a ray.
std::optional<Eigen::MatrixXd> internal_force_of_order(const Assembly& assembly,
                                                       const Eigen::VectorXd& at_rest,
                                                       const std::vector<Eigen::MatrixXd>& path,
                                                       const std::vector<Eigen::MatrixXd>& lower, int order);

// Returns coefficients of the monomials of `degree`, in the order of a pack, for forms with these values
// along the rays (rows): monomials x forms. Needs (degree + 1) (degree + 2) / 2 rays or more.
Eigen::MatrixXd forms_along_rays(const Eigen::Matrix3Xd& directions, int degree,
                                 const Eigen::MatrixXd& values);

}  // namespace palpate
