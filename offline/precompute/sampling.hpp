// Where to sample the ball of tool displacements, and the nonlinear solves there.
//
// Departs from Zhong et al. 2005 section 3.2, whose N^3 grid (in effect ten points on one ray) leaves most of
// the polynomial undetermined. Points are chosen greedily to maximise the information about the polynomial
// (D-optimality), counting that every converged solve also gives the exact tangent du/dd for three
// back-solves: four equations a point.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "offline/fem/static_solver.hpp"
#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/rest_state.hpp"

namespace palpate {

// `count` points of the closed unit ball, or of its half z >= 0, good for Hermite least squares with
// polynomials of `degree` without constant and linear part. Deterministic. Cost: milliseconds.
std::vector<Eigen::Vector3d> choose_sample_points(int degree, int count, bool half);

// Points of the unit ball for the error survey: directions uniform, |x| uniform within one quarter of (0, 1]
// after the other, so that every quarter is measured. A function of `seed` alone.
std::vector<Eigen::Vector3d> choose_survey_points(int count, bool half, std::uint64_t seed);

// A rotation whose third column is `axis`: turns the half-ball z >= 0 to the half-ball about it.
Eigen::Matrix3d frame_about(const Eigen::Vector3d& axis);

// The organ's answer to one tool displacement, from the full nonlinear solve; all from rest.
struct Sample {
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // d, of the patch
  Eigen::VectorXd field;                                   // u at the packed nodes: 3 packed nodes
  Eigen::MatrixXd field_tangent;                    // du/dd: 3 packed nodes x 3; empty for a survey sample
  double energy = 0;                                // stored, less what gravity gave
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  // that the tool applies, = d energy / d d
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();  // d force / d d
  double min_jacobian = 1;
};

// Counts what sampling cost.
struct SolveCounts {
  long solves = 0;
  long iterations = 0;
  long factorizations = 0;
};

// Solves the tool displacements of one site one after the other.
class SiteSampler {
 public:
  // Keeps references to all of them.
  SiteSampler(StaticSolver& solver, const ContactSites& sites, const ContactSite& site,
              const RestState& rest);

  // From the nearest displacement solved before, and where that fails along the straight path from rest. The
  // sample also gets its tangent, and serves as a neighbour from then on. False when no equilibrium was
  // found.
  [[nodiscard]] bool solve(const Eigen::Vector3d& displacement, Sample& sample);

  // The truth for a survey: the straight path from rest in so many increments (more where Newton asks for
  // them), whatever the neighbours say. Field, energy and force only. False when no equilibrium was found.
  [[nodiscard]] bool solve_from_rest(const Eigen::Vector3d& displacement, int increments, Sample& sample);

  const SolveCounts& counts() const { return counts_; }

 private:
  struct Anchor {
    Eigen::Vector3d displacement;
    Eigen::VectorXd u;        // all dofs
    Eigen::MatrixXd tangent;  // all dofs x 3
  };
  LoadCase load_for(const Eigen::Vector3d& displacement) const;
  bool ramp_from_rest(const LoadCase& load, const SolverSettings& settings, Eigen::VectorXd& u);
  void count(const SolveReport& report);
  void read_sample(const Eigen::VectorXd& u, Sample& sample) const;

  StaticSolver* solver_;
  const ContactSite* site_;
  const RestState* rest_;
  Eigen::MatrixXd patch_motion_;  // all dofs x 3: the patch moves as one
  std::vector<Eigen::Index> packed_dofs_;
  std::vector<Anchor> anchors_;  // the first is rest
  SolveCounts counts_;
};

}  // namespace palpate
