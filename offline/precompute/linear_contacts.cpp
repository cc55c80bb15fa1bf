#include "offline/precompute/linear_contacts.hpp"

#include <map>
#include <stdexcept>

#include "offline/numerics/decompositions.hpp"

namespace palpate {

LinearContactAnswer solve_contacts(StaticSolver& solver, const ContactSites& sites,
                                   const std::vector<LinearContact>& contacts) {
  std::map<int, int> num_patches;  // number of patches with this node
  for (const LinearContact& contact : contacts) {
    for (const int node : sites.sites[contact.site].patch_nodes) ++num_patches[node];
  }
  std::map<int, Eigen::Index> place;
  for (const auto& [node, count] : num_patches) place.emplace(node, static_cast<Eigen::Index>(place.size()));
  const auto size = static_cast<Eigen::Index>(3 * place.size());
  Eigen::VectorXd displacement = Eigen::VectorXd::Zero(size);
  for (const LinearContact& contact : contacts) {
    for (const int node : sites.sites[contact.site].patch_nodes)
      displacement.segment<3>(3 * place[node]) += contact.displacement / num_patches[node];
  }
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(solver.assembly().num_dofs(), size);
  for (const auto& [node, at] : place) columns.block<3, 3>(3 * node, 3 * at).setIdentity();
  if (!solver.back_solve(columns)) throw std::logic_error("a Cholesky factor always solves");
  Eigen::MatrixXd compliance(size, size);
  for (const auto& [node, at] : place) compliance.middleRows<3>(3 * at) = columns.middleRows<3>(3 * node);
  const Eigen::VectorXd forces = solve_definite(compliance, displacement);
  LinearContactAnswer answer;
  for (const LinearContact& contact : contacts) {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (const int node : sites.sites[contact.site].patch_nodes)
      force += forces.segment<3>(3 * place[node]) / num_patches[node];
    answer.forces.push_back(force);
  }
  answer.field = packed_rows(sites, columns * forces);
  return answer;
}

}  // namespace palpate
