// What a solve and a build of an organ cost, for `palpate check`.
#pragma once

#include "offline/precompute/scene.hpp"

namespace palpate {

struct OrganCost {
  double solve_bytes = 0;    // memory of a full nonlinear solve beside the mesh: the factor and its matrix
  double solve_seconds = 0;  // a push of a site, solved from rest
  double build_bytes = 0;    // memory of a build of the scene on two threads, roughly
  double build_seconds = 0;  // a build of the scene on one thread
  double pack_bytes = 0;
  int num_sites = 0;
};

// Estimates both from the symbolic factor and from a few solves of the scene's own sites (build_time.hpp).
// The model must be one that a build accepts. Throws std::runtime_error where no site can be pushed.
OrganCost estimate_cost(const Scene& scene, const Model& model);

}  // namespace palpate
