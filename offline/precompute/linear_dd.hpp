// linear_dd (EPFE): the blocks of the inverse stiffness at rest in a pack.
//
// Source: Zhong et al. 2005 eqs. (16)-(19). K is the tangent at rest, with gravity if present, without the
// fixed nodes. Back-solves in blocks give the columns of K^-1 at contact nodes; packs have the packed rows.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "offline/fem/static_solver.hpp"
#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/rest_state.hpp"

namespace palpate {

// Factors K at rest. Throws std::runtime_error when K is not positive definite.
void factor_at_rest(StaticSolver& solver, const RestState& rest = RestState());

struct LinearDd {
  Eigen::MatrixXd contact_compliance;  // A: (3 contact nodes)^2, symmetric
  Eigen::MatrixXd field_compliance;    // 3 packed nodes x 3 contact nodes
};

// Solves for all contact dofs. Throws as factor_at_rest(). `progress` gets done and total columns.
LinearDd compute_linear_dd(const Assembly& assembly, const ContactSites& sites,
                           const std::function<void(int, int)>& progress = {},
                           const RestState& rest = RestState());

// Returns the rows of a site's patch in a contact compliance.
std::vector<Eigen::Index> patch_dofs(const ContactSite& site);

// Returns X = A^-1 E [3 patch nodes x 3]: nodal forces of a patch with compliance A under its three unit
// displacements E. Where close nodes make A numerically singular, springs at the nodes distribute the force.
Eigen::MatrixXd patch_forces(const Eigen::MatrixXd& compliance);

// The exact linear response of one site to a unit displacement: field 3 packed nodes x 3 and stiffness 3 x 3.
struct SiteLinearResponse {
  Eigen::MatrixXd field;
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
};
SiteLinearResponse linear_response(const LinearDd& linear, const ContactSite& site);

// Computes the same response from a factor of the stiffness with the patch held. `solver` loses its factor.
SiteLinearResponse linear_response(StaticSolver& solver, const ContactSites& sites, const ContactSite& site,
                                   const RestState& rest = RestState());

}  // namespace palpate
