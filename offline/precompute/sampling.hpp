// Nonlinear solves at a contact site, with exact derivatives by the tool displacement.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "offline/fem/static_solver.hpp"
#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/rest_state.hpp"
#include "offline/precompute/sample_points.hpp"
#include "offline/precompute/sample_store.hpp"
#include "offline/precompute/taylor_coefficients.hpp"

namespace palpate {

// The organ's response to one tool displacement by the full nonlinear solve, relative to rest.
struct Sample {
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // d, of the patch
  Eigen::VectorXd field;                                   // u at the packed nodes: 3 packed nodes
  Eigen::MatrixXd field_tangent;  // du/dd: 3 packed nodes x 3; empty for a survey sample
  // d2u/dd2: 3 packed nodes x 6, of xx xy xz yy yz zz; empty for a survey sample
  Eigen::MatrixXd field_curvature;
  double energy = 0;                                    // stored energy minus gravity's energy
  Eigen::Vector3d force = Eigen::Vector3d::Zero();      // force of the tool on the tissue, = d energy / d d
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();  // d force / d d
  Eigen::Vector<double, 10> hardening =  // d stiffness / d d: of xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz
      Eigen::Vector<double, 10>::Zero();
  double min_jacobian = 1;  // smallest det F of any element
};

// Least det F of a sample's elements.
inline constexpr double kLeastSampledJacobian = 0.1;
// Sites that are hard to fit drop samples with det F below this limit (bench/polynomials/POLYNOMIALS.md).
inline constexpr double kFollowedJacobian = 0.25;

// Returns the increments of a survey's path: one up to half of the sampled range, two beyond.
inline int survey_increments(double part_of_range) {
  return part_of_range > 0.5 ? 2 : 1;
}

// Counts the cost of sampling.
struct SolveCounts {
  long reused = 0;  // results from the store
  long solves = 0;
  long not_kept = 0;  // solves that the store could not write
  long iterations = 0;
  long factorizations = 0;

  SolveCounts& operator+=(const SolveCounts& other);
};

// Solves the tool displacements of one site in sequence.
class SiteSampler {
 public:
  // Keeps references to all arguments. `kept` (null: none) supplies and keeps solves.
  SiteSampler(StaticSolver& solver, const ContactSites& sites, const ContactSite& site, const RestState& rest,
              SampleFile* kept = nullptr);

  // Starts from the nearest solved push, else follows the straight path from rest. Later solves may start
  // from this push. Sets `sample` with derivatives where solved, only `min_jacobian` for a nearly inverted
  // element. Fields have single precision. Throws std::runtime_error where rest has no stable response.
  [[nodiscard]] PushOutcome solve(const Eigen::Vector3d& displacement, Sample& sample);

  // Solves a survey push along the straight path from rest in `increments` or more, without derivatives. The
  // result does not depend on other solves. Returns false where no equilibrium is found.
  [[nodiscard]] bool solve_from_rest(const Eigen::Vector3d& displacement, int increments, Sample& sample);

  // Returns the Taylor coefficients in y, d = axes y. The store keeps the coefficients; counts() omits them.
  // Empty where a flat element inverts under the small pushes of the differences. Throws as solve().
  std::optional<TaylorCoefficients> coefficients_at_rest(const Eigen::Matrix3d& axes);

  SolveCounts counts() const;

 private:
  struct Anchor {             // a solved state, from which later solves start
    Sample sample;            // without its fields
    Eigen::VectorXd u;        // all dofs
    Eigen::MatrixXd tangent;  // all dofs x 3
  };
  LoadCase load_for(const Eigen::Vector3d& displacement) const;
  const Anchor& rest();  // solved on the first call
  template <typename Compute, typename Numbers, typename Fields>
  PushOutcome load_or_compute(Compute&& compute, const PushRequest& request, Numbers&& each_number,
                              Fields&& each_field);
  PushOutcome compute(const Eigen::Vector3d& displacement, Anchor& anchor, Eigen::MatrixXd& curvature);
  bool compute_from_rest(const Eigen::Vector3d& displacement, int increments, Eigen::VectorXd& u);
  bool ramp_from_rest(const LoadCase& load, Eigen::VectorXd& u);
  void count(const SolveReport& report);
  void read_response(const Eigen::VectorXd& u, Sample& sample) const;
  bool read_derivatives(Anchor& anchor, Eigen::MatrixXd& curvature);
  bool is_on_branch_from_rest(const Anchor& from, const Sample& sample);

  StaticSolver* solver_;
  const ContactSite* site_;
  const RestState* rest_;
  double step_;                   // of second differences, length unit; rounding leaves 8 of 16 digits
  Eigen::MatrixXd patch_motion_;  // all dofs x 3: rigid motion of the patch
  std::vector<Eigen::Index> packed_dofs_;
  Eigen::VectorXd rest_displacement_;  // all dofs
  std::optional<Anchor> rest_anchor_;
  Eigen::MatrixXd rest_curvature_;
  std::vector<Anchor> anchors_;  // one for each sample
  SampleFile* kept_;             // null: no store
  SolveCounts counts_;
  long factorizations_before_;
};

}  // namespace palpate
