#include "offline/pipeline/organ_cost.hpp"

#include "offline/pipeline/build_plan.hpp"
#include "offline/precompute/organ_tree.hpp"

namespace palpate {

OrganCost estimate_cost(const Scene& scene, const Model& model) {
  const Assembly assembly(model, model.fixed_dofs());
  const ContactSites sites = find_contact_sites(scene, model);
  const SamplingPlan plan = plan_sampling(scene, sites, 1);
  const bool has_zones = plan_zone(model, scene, sites).has_value();
  const PlannedWork work = planned_work(model, scene, sites, plan, has_zones);
  const BuildTime time = estimate_build_time(assembly, scene, sites, find_rest(assembly, scene), plan, work);
  OrganCost cost;
  // A solve keeps a factor in double precision, the stiffness, and the entries of the stiffness in the
  // factor.
  const FrontTree& fronts = *assembly.analysis().fronts();
  cost.solve_bytes =
      sizeof(double) * static_cast<double>(fronts.panel_entries()) +
      static_cast<double>(fronts.num_entries()) * (sizeof(double) + sizeof(int) + sizeof(FrontTree::Entry));
  cost.solve_seconds = time.push_seconds;
  cost.build_seconds = time.build_seconds;
  cost.pack_bytes = planned_bytes(scene, sites, plan) + (has_zones ? organ_bytes(model) : 0);
  cost.num_sites = static_cast<int>(sites.sites.size());
  // Factors of the solvers and of the runtime, and copies of the pack and of its parts: offline/measurements.md.
  constexpr double kFactorsOfABuild = 2.3;
  constexpr double kPacksOfABuild = 4.5;
  cost.build_bytes = kFactorsOfABuild * cost.solve_bytes + kPacksOfABuild * cost.pack_bytes;
  return cost;
}

}  // namespace palpate
