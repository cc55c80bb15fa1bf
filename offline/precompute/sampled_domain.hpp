// The sampled domain of a site, the ellipsoid |A d| <= 1, with its samples. A cut may leave samples outside.
//
// The domain starts as a ball or its inward half. It is cut along displacements where:
//   1. the solver finds no equilibrium,
//   2. an element nearly inverts,
//   3. the equilibrium is not on the path from rest, or
//   4. polynomials do not fit.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <stdexcept>
#include <string>

#include "offline/precompute/polynomial_dd.hpp"
#include "offline/precompute/sampling.hpp"
#include "offline/precompute/scene.hpp"

namespace palpate {

// Thrown where a push fails that the domain must contain, as its semi-axes are kLeastReachPart or more.
class DomainTooSmall : public std::runtime_error {
 public:
  DomainTooSmall(const std::string& message, double push)
      : std::runtime_error(message), out_of_reach_(push) {}
  double out_of_reach() const { return out_of_reach_; }  // |d| of the failed push: length unit

 private:
  double out_of_reach_;
};

class SampledDomain {
 public:
  // Keeps references to all arguments. `label`: of the site's node. `samples.to_unit` is A, 1 / length unit.
  SampledDomain(SiteSampler& sampler, const Scene& scene, const ContactSite& site, int label,
                SiteSamples& samples);

  // Adds the known data at rest.
  void sample_rest();

  // Takes a sample at x = A d, unless present. Returns false after a cut of the domain before a failed push:
  // x now belongs to a smaller displacement. Throws DomainTooSmall with the node where the push also fails in
  // the smallest domain, of a quarter of the largest displacement.
  [[nodiscard]] bool sample(const Eigen::Vector3d& x);

  // Drops samples with det F below kFollowedJacobian and cuts the domain before the dropped samples, as long
  // as a quarter of the largest displacement remains. Later samples below this limit also cut the domain.
  void leave_crushed();

  // Tests `fit`, of degree 2 or more, at `num_pushes` new samples near the edge, where fits of two degrees
  // differ most. Cuts the domain before samples far from the fit and before failed samples, as long as a
  // quarter remains. The caller must fit again. Cost: the samples, a fit, and 800 fields.
  void try_fit(const SitePolynomial& fit, double target, size_t num_pushes);

  // Requested pushes, failed ones included.
  size_t num_solves() const { return num_solves_; }
  size_t num_inside() const;                      // samples in the domain, without rest
  double min_jacobian() const;                    // over the samples in the domain
  PushOutcome cut_by() const { return cut_by_; }  // reason of the last cut

 private:
  struct TakenSample {
    std::optional<Sample> sample;               // empty where the push failed or the domain was cut
    PushOutcome failure = PushOutcome::solved;  // reason where the domain could not be cut
  };
  TakenSample take(const Eigen::Vector3d& displacement);
  bool cut_before(const Eigen::Vector3d& displacement, double fraction, PushOutcome outcome);

  SiteSampler& sampler_;
  const Scene& scene_;
  const ContactSite& site_;
  int label_;
  SiteSamples& samples_;
  size_t num_solves_ = 0;
  PushOutcome cut_by_ = PushOutcome::solved;
  double least_jacobian_ = kLeastSampledJacobian;  // least accepted det F of a sample
};

}  // namespace palpate
