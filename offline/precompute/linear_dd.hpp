// linear_dd (EPFE): the blocks of the inverse stiffness at rest that a pack carries.
//
// Source: Zhong et al. 2005 eqs. (16)-(19). K is the tangent at rest, under gravity if there is any, with the
// fixed nodes taken out; of K^-1 only the columns of the contact nodes are formed, by blocked back-solves with
// one sparse factor, and of those only the rows of packed nodes are kept.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <functional>
#include <vector>

#include "offline/fem/static_solver.hpp"
#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/rest_state.hpp"

namespace palpate {

// Factors K at rest. Throws std::runtime_error when it is not positive definite.
void factor_at_rest(StaticSolver& solver, const RestState& rest = RestState());

struct LinearDd {
  Eigen::MatrixXd contact_compliance;  // A: (3 contact nodes)^2, symmetric
  Eigen::MatrixXd field_compliance;    // 3 packed nodes x 3 contact nodes
};

// Throws std::runtime_error when the stiffness at rest is not positive definite. `progress` gets done, total
// columns.
LinearDd compute_linear_dd(const Assembly& assembly, const ContactSites& sites,
                           const std::function<void(int, int)>& progress = {},
                           const RestState& rest = RestState());

// The rows of a site's patch in a contact compliance.
std::vector<Eigen::Index> patch_dofs(const ContactSite& site);

// A patch's compliance A factored. Nodes so close that A is singular to rounding get springs and share their force.
Eigen::LLT<Eigen::MatrixXd> factor_patch(const Eigen::MatrixXd& compliance);

// X = A^-1 E: nodal forces on a patch for unit displacements of all its nodes together; 3 patch nodes x 3.
Eigen::MatrixXd patch_forces(const Eigen::MatrixXd& compliance);

// The exact linear answer of one site: field 3 packed nodes x 3 and stiffness 3 x 3 per unit tool
// displacement.
struct SiteLinearResponse {
  Eigen::MatrixXd field;
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
};
SiteLinearResponse linear_response(const LinearDd& linear, const ContactSite& site);

// The same without those blocks, by a factor of its own with the patch held. `solver` is left without one.
SiteLinearResponse linear_response(StaticSolver& solver, const ContactSites& sites, const ContactSite& site,
                                   const RestState& rest = RestState());

}  // namespace palpate
