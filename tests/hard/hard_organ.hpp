// An organ taken to a pack by the stages of `palpate build`, asked through the real runtime, and solved in full.
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
  bool fewest = false;  // sites are sampled only where the target asks for it
  double target = 0.01;
  FieldPrecision precision = FieldPrecision::automatic;
  int survey_samples = 0;  // of a site; 0: as a build has them
};

struct Truth {
  bool solved = false;
  Eigen::VectorXd field;  // 3 packed nodes
  std::vector<Eigen::Vector3d> forces;
};

class Organ {
 public:
  // Throws what a build throws.
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
  // At the node nearest to a place.
  std::uint32_t site_near(const Eigen::Vector3d& place) const;

  // Patches moved from rest, all ramping together in so many increments at the least; a node of several follows their
  // mean and each bears its part of the force.
  Truth solve(const std::vector<pal_contact>& contacts, int increments = 8,
              const std::vector<int>& fixed_nodes = {}) const;

  // An answer of the runtime beside the truth.
  Answer ask(pal_model model, const std::vector<pal_contact>& contacts, const Truth& truth) const;

  // What was answered: errors, estimates and flags filled in.
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

// Those that may answer one contact, the default first; affine_site where sites are left without samples.
std::vector<pal_model> models_for_one(const Organ& organ);
std::string asked_of(pal_model model);  // "auto", "linear", ...

// These contacts asked of every model that may answer them, the default first.
std::vector<Answer> ask_all(const Organ& organ, const std::vector<pal_contact>& contacts);

// The answers to several sets of contacts, of each model the worst: by error over bar, unsound ones before all.
std::vector<Answer> worst_of(const std::vector<std::vector<Answer>>& sets, const Bar& bar);

// Made once a process and name.
const Organ& shared_organ(const std::string& name, const std::function<OrganSpec()>& spec);

}  // namespace palpate::hard
