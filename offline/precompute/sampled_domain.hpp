// The sampled domain of a site: the ellipsoid |A d| <= 1 of displacements that its polynomial is for, and the samples
// in it.
//
// It begins as a ball, or its inward half, and is shortened along the displacements that the solver cannot reach,
// that nearly invert an element, that lead to another equilibrium than the path from rest, or that polynomials do not
// follow.
#pragma once

#include <Eigen/Core>

#include "offline/precompute/polynomial_dd.hpp"
#include "offline/precompute/sampling.hpp"
#include "offline/precompute/scene.hpp"

namespace palpate {

class SampledDomain {
 public:
  // Keeps references to all of them. `label`: of the site's node. `samples.to_unit` is A, 1 / length unit.
  SampledDomain(SiteSampler& sampler, const Scene& scene, const ContactSite& site, int label,
                SiteSamples& samples);

  // Adds what is known at rest.
  void sample_rest();

  // Adds a sample at x = A d, shortening the domain until there is one to be had. Throws std::runtime_error that
  // names the node where a quarter of the largest displacement is not to be had.
  void sample(const Eigen::Vector3d& x);

  // Ends the domain before the samples below kFollowedJacobian, which are no longer fitted to, wherever a quarter of
  // the largest displacement is left; from here on no sample is taken below it. Returns the number of those that were
  // given up.
  size_t leave_crushed();

  // Adds so many samples near the edge, where fits of two degrees differ most, and ends the domain before those that
  // `fit`, which has not seen them, is far off from, wherever a quarter is left. One that cannot be had ends it
  // likewise, and is not added. A fit made before is not of the domain after. Cost: that of the samples, and 800
  // fields.
  void try_fit(const SitePolynomial& fit, double target, size_t num_pushes);

  // But that of rest.
  size_t num_samples() const;
  double min_jacobian() const;                    // over the samples
  PushOutcome cut_by() const { return cut_by_; }  // why it was shortened last, if it was

 private:
  bool is_sampled(const Eigen::Vector3d& x);
  bool keep_part(const Eigen::Vector3d& displacement, double part, PushOutcome outcome);

  SiteSampler& sampler_;
  const Scene& scene_;
  const ContactSite& site_;
  int label_;
  SiteSamples& samples_;
  PushOutcome cut_by_ = PushOutcome::solved;
  double least_jacobian_ = kLeastSampledJacobian;  // of a sample
};

}  // namespace palpate
