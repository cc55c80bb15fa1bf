// A translated and rotated model is the same organ: its pack gives the same response, translated and rotated.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <vector>

#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/site_survey.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate::test {
namespace moved_model_test {

struct BuiltOrgan {
  BuiltOrgan(TouchedBlock block, Directions directions) : block_(std::move(block)) {
    block_.scene.directions = directions;
    block_.sites = find_contact_sites(block_.scene, block_.model);
    const Assembly assembly(block_.model, block_.model.fixed_dofs());
    linear_ = compute_linear_dd(assembly, block_.sites);
    SamplingPlan plan;
    plan.target = 1e-3;
    plan.survey_samples = 4;
    results_ = sample_sites(assembly, block_.scene, block_.sites, linear_, plan);
    PackContent content{block_.model, block_.scene, block_.sites, &linear_, &results_, false, {}, {}};
    bytes_ = std::make_unique<AlignedBytes>(write_pack(content));
  }
  const AlignedBytes& bytes() const { return *bytes_; }
  const std::vector<SiteResult>& results() const { return results_; }
  const TouchedBlock& block() const { return block_; }

 private:
  TouchedBlock block_;
  LinearDd linear_;
  std::vector<SiteResult> results_;
  std::unique_ptr<AlignedBytes> bytes_;
};

class MovedModel : public ::testing::TestWithParam<Directions> {};

TEST_P(MovedModel, GivesTheSameAnswers) {
  const Eigen::Matrix3d R = Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).matrix();
  const Eigen::Vector3d away(30, -70, 110);
  const TouchedBlock block = touched_block(4, 0.3);
  TouchedBlock moved = block;
  for (Eigen::Vector3d& position : moved.model.positions) position = R * position + away;
  const BuiltOrgan here(block, GetParam());
  const BuiltOrgan there(moved, GetParam());
  const OpenPack here_pack(here.bytes());
  const OpenPack there_pack(there.bytes());
  for (const pal_model model : {PAL_MODEL_LINEAR, PAL_MODEL_POLYNOMIAL}) {
    OwnedSession at_here(here_pack.get(), model, 1, 0);
    OwnedSession at_there(there_pack.get(), model, 1, 0);
    for (uint32_t site = 0; site < here.results().size(); ++site) {
      EXPECT_EQ(here.results()[site].samples, there.results()[site].samples);
      EXPECT_EQ(here.results()[site].polynomial.degree, there.results()[site].polynomial.degree);
      for (const Eigen::Vector3d& d : {Eigen::Vector3d(0.05, 0.02, -0.1), Eigen::Vector3d(-0.02, 0.1, -0.04),
                                       Eigen::Vector3d(0.001, 0, -0.14)}) {
        const Eigen::Vector3d turned = R * d;
        const auto expected = at_here.touch({{site, {d[0], d[1], d[2]}, 0, {}, {}, {}}}).front();
        const auto actual =
            at_there.touch({{site, {turned[0], turned[1], turned[2]}, 0, {}, {}, {}}}).front();
        const Eigen::Vector3d force = R.transpose() * Eigen::Vector3d(actual.force);
        EXPECT_LE((force - Eigen::Vector3d(expected.force)).norm(), 1e-6 * force.norm()) << site;
        const Eigen::VectorXd field = as_vector(at_here.field());
        Eigen::VectorXd back = as_vector(at_there.field());
        for (Eigen::Index node = 0; node < back.size() / 3; ++node)
          back.segment<3>(3 * node) = (R.transpose() * back.segment<3>(3 * node)).eval();
        EXPECT_LE((back - field).lpNorm<Eigen::Infinity>(), 1e-6 * d.norm()) << site;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, MovedModel, ::testing::Values(Directions::all, Directions::inward));

}  // namespace moved_model_test
}  // namespace palpate::test
