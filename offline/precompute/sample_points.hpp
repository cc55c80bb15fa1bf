// Chooses sample points in the ball of tool displacements.
//
// The N^3 grid of Zhong et al. 2005 section 3.2, in effect ten points on a ray, leaves most of the polynomial
// undetermined. Here a greedy choice maximises the information about the polynomial (D-optimality). A
// converged solve also gives exact first and second derivatives for nine back-solves: ten equations a point.
// The chosen points lie mostly on the boundary. Some further points inside the ball serve functions that no
// polynomial follows (bench/polynomials/POLYNOMIALS.md).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

namespace palpate {

// Value, three first and six second derivatives of each dof.
inline constexpr int kEquationsPerSample = 10;

// Points of the closed unit ball, or its half z >= 0, for Hermite fits without constant and linear part. Each
// point serves the lowest degree that earlier points do not determine twice. From the 13th on, every third
// point is the inner candidate farthest from all chosen points; finally all points are. The sequence is
// fixed, computed on demand and limited to about 300 points (150 in a half). Thread-safe.
class SamplePoints {
 public:
  explicit SamplePoints(bool half);
  Eigen::Vector3d operator[](size_t index);

 private:
  void choose_next();
  std::optional<Eigen::Vector3d> most_informative();  // empty where all candidates are near chosen points
  Eigen::Vector3d farthest_inner() const;
  std::mutex mutex_;
  std::vector<Eigen::Vector3d> candidates_;
  std::vector<Eigen::Vector3d> inner_candidates_;
  std::vector<Eigen::MatrixXd> candidate_rows_;  // rows of the design at each candidate
  Eigen::MatrixXd information_;                  // M = sum over chosen points of R^T R, R their rows
  int highest_degree_ = 0;
  int degree_ = 0;
  std::vector<Eigen::Vector3d> chosen_;
};

// Draws survey points in the unit ball: uniform directions, |x| uniform in each quarter of (0, 1] in turn,
// outermost first. The turns begin after the first `skipped` quarters.
std::vector<Eigen::Vector3d> choose_survey_points(int count, bool half, std::uint64_t seed,
                                                  size_t skipped = 0);

// Returns the smallest rotation that turns `from` into `to`; both are unit vectors.
Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

// Returns a rotation with third column `axis`, from the half-ball z >= 0 to the half-ball about the axis.
Eigen::Matrix3d frame_about(const Eigen::Vector3d& axis);

// Returns `count` points spread evenly over the unit sphere.
std::vector<Eigen::Vector3d> sphere_points(int count);

}  // namespace palpate
