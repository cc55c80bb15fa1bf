// A site in the middle of a block's top, with the inputs of its sampling.
#pragma once

#include <gtest/gtest.h>

#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/sampling.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate::test {

struct SamplingSite : ::testing::Test {
  TouchedBlock block = touched_block(4, 0.26);
  Assembly assembly{block.model, block.model.fixed_dofs()};
  StaticSolver solver{assembly};
  const ContactSite& site = block.sites.sites[4];  // the middle of nine
  LinearDd linear = compute_linear_dd(assembly, block.sites);
  const RestState rest;

  static Sample solved(SiteSampler& sampler, const Eigen::Vector3d& d) {
    Sample sample;
    EXPECT_EQ(sampler.solve(d, sample), PushOutcome::solved);
    EXPECT_EQ(sample.displacement, d);
    return sample;
  }
};

}  // namespace palpate::test
