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
  // before it, and x is of a smaller displacement. Throws std::runtime_error that names the node where a quarter of the
  // largest displacement does not leave room for that.
  [[nodiscard]] bool sample(const Eigen::Vector3d& x);

  // Ends the domain before the samples below kFollowedJacobian, which are no longer fitted to, and before further ones
  // below it, where a quarter of the largest displacement leaves room for that.
  void leave_crushed();

  // Takes so many samples near the edge, where fits of two degrees differ most, and ends the domain before those that
  // `fit`, of two degrees or more, is far off from without having seen them, and before those that cannot be had, where
  // a quarter leaves room. A fit made before is not of the domain after. Cost: that of the samples, a fit, and 800
  // fields.
  void try_fit(const SitePolynomial& fit, double target, size_t num_pushes);

  // Pushes that were asked for, with those that could not be had.
  size_t num_solves() const { return num_solves_; }
  size_t num_inside() const;                      // samples in the domain but that of rest
  double min_jacobian() const;                    // over the samples in the domain
  PushOutcome cut_by() const { return cut_by_; }  // why it was shortened last, if it was

 private:
  struct Taken {
    std::optional<Sample> sample;
    PushOutcome refused = PushOutcome::solved;  // why it cannot be had, though it is in the domain
  };
  Taken take(const Eigen::Vector3d& displacement);
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
