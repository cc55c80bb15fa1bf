// The nonlinear solves at a contact site, each with the exact derivatives of the answer.
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

// The organ's answer to one tool displacement, from the full nonlinear solve; all from rest.
struct Sample {
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // d, of the patch
  Eigen::VectorXd field;                                   // u at the packed nodes: 3 packed nodes
  Eigen::MatrixXd field_tangent;    // du/dd: 3 packed nodes x 3; empty for a survey sample
  Eigen::MatrixXd field_curvature;  // d2u/dd2: 3 packed nodes x 6, of xx xy xz yy yz zz; empty likewise
  double energy = 0;                // stored, less what gravity gave
  Eigen::Vector3d force = Eigen::Vector3d::Zero();      // that the tool applies, = d energy / d d
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();  // d force / d d
  Eigen::Vector<double, 10> hardening =  // d stiffness / d d: of xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz
      Eigen::Vector<double, 10>::Zero();
  double min_jacobian = 1;
};

// det F of an element that nearly inverts: no sample has less.
inline constexpr double kLeastSampledJacobian = 0.1;
// Sites that are hard to fit leave out samples below this: of slivers that collapse in a few directions. On the brain
// at 2 h, 60 solves a site, the largest errors of 320 pushes at its eight hardest sites, at nu = 0.147 and 0.4: 1.6 and
// 0.5 % with 0.2, 0.4 and 0.4 with 0.25, 0.34 and 0.35 with 0.3, where domains reach a tenth less far.
inline constexpr double kFollowedJacobian = 0.25;

// How many increments a survey takes from rest to so much of the sampled range: one to its half, two beyond.
inline int survey_increments(double part_of_range) {
  return part_of_range > 0.5 ? 2 : 1;
}

// Counts what sampling cost.
struct SolveCounts {
  long reused = 0;  // found among those that were kept
  long solves = 0;
  long not_kept = 0;  // of the solves, for want of room on the disk
  long iterations = 0;
  long factorizations = 0;

  SolveCounts& operator+=(const SolveCounts& other);
};

// Solves the tool displacements of one site one after the other.
class SiteSampler {
 public:
  // Keeps references to all of them. What `kept` holds (null: nothing) is not solved again, and what is solved is kept.
  SiteSampler(StaticSolver& solver, const ContactSites& sites, const ContactSite& site, const RestState& rest,
              SampleFile* kept = nullptr);

  // From the nearest displacement solved before, and where that fails along the straight path from rest. The
  // sample also gets its derivatives, and serves as a neighbour from then on; that of rest takes no solve. `sample` is
  // set where it is solved; of one that nearly inverts an element, its smallest Jacobian. Fields are right to single
  // precision. Throws std::runtime_error where the organ at rest has no stable answer to a push.
  [[nodiscard]] PushOutcome solve(const Eigen::Vector3d& displacement, Sample& sample);

  // The truth for a survey: the straight path from rest in so many increments (more where Newton asks for
  // them), whatever the neighbours say. Field, energy and force only. False when no equilibrium was found.
  [[nodiscard]] bool solve_from_rest(const Eigen::Vector3d& displacement, int increments, Sample& sample);

  // In y, d = axes y; kept as a solve is, and not counted as one. None where an element is so flat that the small
  // pushes it is found by invert it. Throws as solve() does.
  std::optional<TaylorCoefficients> rest_series(const Eigen::Matrix3d& axes);

  SolveCounts counts() const;

 private:
  struct Anchor {
    Sample sample;            // without its fields
    Eigen::VectorXd u;        // all dofs
    Eigen::MatrixXd tangent;  // all dofs x 3
  };
  LoadCase load_for(const Eigen::Vector3d& displacement) const;
  const Anchor& rest();  // made when first asked for
  template <typename Compute, typename Numbers, typename Fields>
  PushOutcome recall_or(Compute&& compute, const PushRequest& request, Numbers&& each_number,
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
  double step_;  // of second differences: of 16 digits, rounding and the next derivative leave 8
  Eigen::MatrixXd patch_motion_;  // all dofs x 3: the patch moves as one
  std::vector<Eigen::Index> packed_dofs_;
  Eigen::VectorXd rest_displacement_;  // all dofs
  std::optional<Anchor> rest_anchor_;
  Eigen::MatrixXd rest_curvature_;
  std::vector<Anchor> anchors_;  // of the samples
  SampleFile* kept_;
  SolveCounts counts_;
  long factorizations_before_;
};

}  // namespace palpate
