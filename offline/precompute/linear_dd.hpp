// linear_dd (EPFE): the blocks of the inverse stiffness at rest in a pack.
//
// Source: Zhong et al. 2005 eqs. (16)-(19). K is the tangent at rest, with gravity if present, without the
// fixed nodes. Blocked back-solves with one sparse factor give the columns of K^-1 at contact nodes; the rows
// of packed nodes are kept.
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

// Throws std::runtime_error when the stiffness at rest is not positive definite. `progress` gets done and
// total columns.
LinearDd compute_linear_dd(const Assembly& assembly, const ContactSites& sites,
                           const std::function<void(int, int)>& progress = {},
                           const RestState& rest = RestState());

// Rows of a site's patch in a contact compliance.
std::vector<Eigen::Index> patch_dofs(const ContactSite& site);

// X = A^-1 E: nodal forces of a patch of compliance A under unit displacements; 3 patch nodes x 3. Nodes so close that A
// is numerically singular get springs and share their force.
Eigen::MatrixXd patch_forces(const Eigen::MatrixXd& compliance);

// The exact linear response of one site to a unit displacement: field 3 packed nodes x 3 and stiffness 3 x 3.
struct SiteLinearResponse {
  Eigen::MatrixXd field;
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
};
SiteLinearResponse linear_response(const LinearDd& linear, const ContactSite& site);

// Computes the response by a factor with held patch instead of the blocks. `solver` loses its factor.
SiteLinearResponse linear_response(StaticSolver& solver, const ContactSites& sites, const ContactSite& site,
                                   const RestState& rest = RestState());

}  // namespace palpate
