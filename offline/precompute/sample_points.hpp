// Where to sample the ball of tool displacements.
//
// Departs from Zhong et al. 2005 section 3.2, whose N^3 grid (in effect ten points on one ray) leaves most of the
// polynomial undetermined. Points are chosen greedily to maximise the information about the polynomial
// (D-optimality), counting that every converged solve also gives the exact first and second derivatives of the field
// for nine back-solves, each refined, with the factor at hand: ten equations a point. On the brain at 1 h, degree 3
// takes 4 solves so, 6 with first derivatives alone, and degree 5 takes 8 in place of 16. Such points lie on the
// boundary, nearly all of them; for what no polynomial follows, some are spread over the inside (the paper's cylinder
// at 40 % strain, 60 solves of degree 7: p95 0.68 -> 0.36 %, with the weights of polynomial_dd.hpp).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

namespace palpate {

// Value, three first and six second derivatives of each dof.
inline constexpr int kEquationsPerSample = 10;

// Points of the closed unit ball, or of its half z >= 0, good for Hermite least squares with polynomials without
// constant and linear part: each next one chosen for the lowest degree that it and those before it do not yet
// determine twice over; of the later ones every third, and all once no other is left, instead inside, the farthest
// from all before. Always the same sequence, made as far as it is asked for, up to some 300 (150 in a half);
// thread-safe. Cost: some 20 ms a point, from the fortieth on 0.1 s, once.
class SamplePoints {
 public:
  explicit SamplePoints(bool half);
  Eigen::Vector3d operator[](size_t index);

 private:
  void choose_next();
  std::optional<Eigen::Vector3d> most_informative();  // none where all candidates are near chosen points
  Eigen::Vector3d farthest_inner() const;
  std::mutex mutex_;
  std::vector<Eigen::Vector3d> candidates_;
  std::vector<Eigen::Vector3d> inner_candidates_;
  std::vector<Eigen::MatrixXd> candidate_rows_;  // of the design, at each candidate
  Eigen::MatrixXd information_;                  // M = sum over chosen points of R^T R, R their rows
  int highest_degree_ = 0;
  int degree_ = 0;
  std::vector<Eigen::Vector3d> chosen_;
};

// Points of the unit ball for the error survey: directions uniform, |x| uniform within one quarter of (0, 1]
// after the other, so that every quarter is measured: from the outermost inward, the first `skipped` of that round
// left out.
std::vector<Eigen::Vector3d> choose_survey_points(int count, bool half, std::uint64_t seed,
                                                  size_t skipped = 0);

// A rotation whose third column is `axis`: turns the half-ball z >= 0 to the half-ball about it.
Eigen::Matrix3d frame_about(const Eigen::Vector3d& axis);

// So many points spread evenly over the unit sphere.
std::vector<Eigen::Vector3d> sphere_points(int count);

}  // namespace palpate
