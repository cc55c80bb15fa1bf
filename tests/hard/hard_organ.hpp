// An organ with a pack from the stages of `palpate build`, its answers from the real runtime, and its full
// solve.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/rest_state.hpp"
#include "tests/hard/hard_case.hpp"

namespace palpate::hard {

struct OrganSpec {
  Model model;
  std::vector<int> sites;  // nodes of the model
  double max_displacement = 0.15;
  double tip_radius = 0;
  int max_contacts = 3;
  int zone_rings = 1;
  bool polynomial = true;
  bool fewest = false;  // sample only the sites that the target requires
  double target = 0.01;
  FieldPrecision precision = FieldPrecision::automatic;
  int survey_samples = 0;  // for each site; 0 selects the number of a build
};

struct Truth {
  bool solved = false;
  Eigen::VectorXd field;  // 3 packed nodes
  std::vector<Eigen::Vector3d> forces;
};

class Organ {
 public:
  // Throws a build's errors.
  explicit Organ(OrganSpec spec);
  Organ(Model model, Scene scene, int survey_samples = 0);
  Organ(const Organ&) = delete;
  Organ& operator=(const Organ&) = delete;

  const Model& model() const { return model_; }
  const Scene& scene() const { return scene_; }
  const ContactSites& sites() const { return sites_; }
  const OpenedPack& opened() const { return *opened_; }
  const AlignedBytes& bytes() const { return *bytes_; }
  size_t num_sites() const { return sites_.sites.size(); }
  double edge() const { return sites_.mean_surface_edge; }
  // The site nearest to a place.
  std::uint32_t site_near(const Eigen::Vector3d& place) const;

  // Patches move from rest in one ramp of at least so many increments, or in two: along `way`, contacts at the
  // same sites, then to the goal. A node of several patches takes the mean motion, and each patch bears its
  // part of the node's force.
  Truth solve(const std::vector<pal_contact>& contacts, int increments = 8,
              const std::vector<int>& fixed_nodes = {}, const std::vector<pal_contact>& way = {}) const;

  // A runtime answer compared with the reference.
  Answer ask(pal_model model, const std::vector<pal_contact>& contacts, const Truth& truth) const;

  // Fills in errors, estimates and flags of an answer.
  Answer compare(const std::string& by, const std::vector<pal_contact>& contacts,
                 const std::vector<pal_contact_result>& results, const Eigen::VectorXd& field,
                 const Truth& truth) const;

 private:
  Model model_;
  Scene scene_;
  ContactSites sites_;
  std::unique_ptr<Assembly> assembly_;
  RestState rest_;
  std::unique_ptr<AlignedBytes> bytes_;
  std::unique_ptr<OpenedPack> opened_;
};

pal_contact push(std::uint32_t site, const Eigen::Vector3d& displacement);

// Models that may answer a contact, the default first; affine_site where sites have no samples.
std::vector<pal_model> models_for_one(const Organ& organ);
std::string asked_of(pal_model model);  // "auto", "linear", ...

// These contacts on every model that may answer them, the default first. `way`: of the full solve.
std::vector<Answer> ask_all(const Organ& organ, const std::vector<pal_contact>& contacts,
                            const std::vector<pal_contact>& way = {});

// The worst answer of each model over several contact sets: by verdict, then by error over bar.
std::vector<Answer> worst_of(const std::vector<std::vector<Answer>>& sets, const Bar& bar);

// Built once a process and name.
const Organ& shared_organ(const std::string& name, const std::function<OrganSpec()>& spec);

}  // namespace palpate::hard
