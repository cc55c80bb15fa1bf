// The sampled domain of a site: the ellipsoid |A d| <= 1 of displacements that its polynomial is for, and the samples
// that it is fitted to: those in it and, where it was shortened after they were taken, some beyond it.
//
// It begins as a ball, or its inward half, and is shortened along the displacements that the solver cannot reach,
// that nearly invert an element, that lead to another equilibrium than the path from rest, or that polynomials do not
// follow.
#pragma once

#include <Eigen/Core>
#include <optional>

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

  // Takes a sample at x = A d, unless there is one already. False where there is none to be had: the domain now ends
  // before it, and x is of a smaller displacement. Throws std::runtime_error that names the node where it would end
  // before a quarter of the largest.
  [[nodiscard]] bool sample(const Eigen::Vector3d& x);

  // Ends the domain before the samples below kFollowedJacobian, which are no longer fitted to, and before further ones
  // below it; or at a quarter of the largest displacement, within which they stay.
  void leave_crushed();

  // Takes so many samples near the edge, where fits of two degrees differ most, and ends the domain before those that
  // `fit`, of two degrees or more, is far off from without having seen them, or at a quarter. One that cannot be had
  // ends it likewise. A fit made before is not of the domain after. Throws as sample(). Cost: that of the samples, a
  // fit, and 800 fields.
  void try_fit(const SitePolynomial& fit, double target, size_t num_pushes);

  size_t num_solves() const {
    return num_solves_;
  }                             // pushes that were asked for, with those that could not be had
  double min_jacobian() const;  // over the samples in the domain
  PushOutcome cut_by() const { return cut_by_; }  // why it was shortened last, if it was

 private:
  std::optional<Sample> take(const Eigen::Vector3d& displacement);
  bool end_before(const Eigen::Vector3d& displacement, double part, PushOutcome outcome);

  SiteSampler& sampler_;
  const Scene& scene_;
  const ContactSite& site_;
  int label_;
  SiteSamples& samples_;
  size_t num_solves_ = 0;
  PushOutcome cut_by_ = PushOutcome::solved;
  double least_jacobian_ = kLeastSampledJacobian;  // of a sample
};

}  // namespace palpate
