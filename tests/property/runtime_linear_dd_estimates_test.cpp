// Error estimates and flags of linear_dd.
#include <gtest/gtest.h>

#include "tests/support/runtime_linear_dd_fixture.hpp"

namespace palpate::test::runtime_linear_dd_fixture {
namespace runtime_linear_dd_estimates_test {

// Two contact nodes with identical columns: displacements do not determine both forces.
TEST_F(RuntimeLinearDd, SingularComplianceIsFlaggedAndFinite) {
  LinearDd singular = small_.linear;
  const std::vector<int>& patch = small_.sites.sites[4].patch;
  const Eigen::Index from = 3 * patch[0];
  const Eigen::Index to = 3 * patch[1];
  singular.contact_compliance.middleRows<3>(to) = singular.contact_compliance.middleRows<3>(from).eval();
  singular.contact_compliance.middleCols<3>(to) = singular.contact_compliance.middleCols<3>(from).eval();
  singular.field_compliance.middleCols<3>(to) = singular.field_compliance.middleCols<3>(from).eval();
  PackContent content = small_.content();
  content.linear = &singular;
  content.polynomials = nullptr;
  const AlignedBytes bytes = write_pack(content);
  const OpenPack pack(bytes);
  OwnedSession session(pack.get(), PAL_MODEL_LINEAR, 2, 0);
  const Eigen::Vector3d d = any_displacement();
  const auto result = session.touch(as_runtime({{4, d}})).front();
  EXPECT_TRUE(result.flags & PAL_FLAG_ILL_CONDITIONED);
  EXPECT_TRUE(all_finite(result));
  EXPECT_TRUE(all_finite(session.field()));
  EXPECT_GT(force_of(result).dot(d), 0);
  // The regularisation is 1e-9 of the compliance, so the patch still follows the tool.
  const Eigen::VectorXd field = as_vector(session.field());
  const Eigen::Index centre = 3 * small_.sites.sites[4].packed_node;
  EXPECT_LE((field.segment<3>(centre) - d).norm(), 1e-4 * d.norm());
  EXPECT_FALSE(session_.touch(as_runtime({{4, d}})).front().flags & PAL_FLAG_ILL_CONDITIONED);
}

TEST_F(RuntimeLinearDd, ErrorEstimateIsTheSurveysBin) {
  const SurveyTable& table = small_.surveys[0].table;
  for (int bin = 0; bin < kSurveyBins; ++bin) {
    const double size = kMaxDisplacement * (bin + 0.9) / kSurveyBins;
    const auto result = session_.touch(as_runtime({{4, {0, 0, -size}}})).front();
    const auto estimate = [](const ErrorFigures& figures) {
      return figures.bound * (1 - 0.1 * figures.growth);
    };
    const SurveyBin& of = table.bins[static_cast<size_t>(bin)];
    EXPECT_NEAR(result.displacement_error, estimate(of.displacement), 1e-12);
    EXPECT_NEAR(result.force_error, estimate(of.force), 1e-12);
    EXPECT_EQ(result.flags, 0U);
  }
  const auto beyond = session_.touch(as_runtime({{4, {0, 0, -1.1 * kMaxDisplacement}}})).front();
  EXPECT_EQ(beyond.flags, static_cast<uint32_t>(PAL_FLAG_EXTRAPOLATED));
  EXPECT_EQ(beyond.displacement_error, 1);
  const auto two = session_.touch(as_runtime({{0, {0, 0, -0.01}}, {11, {0, 0, -0.01}}}));
  EXPECT_EQ(two[0].displacement_error, 1);  // the survey has no sets of two contacts
}

TEST_F(RuntimeLinearDd, ABinWithoutSamplesIsUnknown) {
  PackContent content = small_.content();
  content.surveys[0].table = survey_errors({}, kMaxDisplacement, {});
  const AlignedBytes bytes = write_pack(content);
  const OpenPack pack(bytes);
  OwnedSession session(pack.get(), PAL_MODEL_LINEAR, 1, 0);
  const auto result = session.touch(as_runtime({{4, {0, 0, -0.01}}})).front();
  EXPECT_EQ(result.displacement_error, 1);
  EXPECT_EQ(result.force_error, 1);
}

// An error of three times the force gives an estimate of three times the force, not of the whole.
TEST_F(RuntimeLinearDd, AnEstimateMayExceedTheForce) {
  const auto contacts = as_runtime({{4, {0, 0, -0.9 * kMaxDisplacement}}});
  PackContent content = small_.content();
  SurveyTable& table = content.surveys[0].table;
  // A small force for its displacement.
  table.force_scale = 2 * force_of(session_.touch(contacts).front()).norm();
  for (SurveyBin& bin : table.bins) bin.force.bound = 3;
  const AlignedBytes bytes = write_pack(content);
  const OpenPack pack(bytes);
  OwnedSession session(pack.get(), PAL_MODEL_LINEAR, 1, 0);
  EXPECT_EQ(session.touch(contacts).front().force_error, 3);
}

TEST_F(RuntimeLinearDd, AutoFallsBackToItAndSaysSo) {
  OwnedSession automatic(pack_.get(), PAL_MODEL_AUTO, 2, 2);
  const auto contacts = as_runtime({{0, any_displacement()}, {11, any_displacement()}});
  const auto results = automatic.touch(contacts);
  EXPECT_EQ(results[0].model, PAL_MODEL_LINEAR);
  EXPECT_TRUE(results[0].flags & PAL_FLAG_LINEAR_FALLBACK);
  EXPECT_EQ(force_of(results[0]), force_of(session_.touch(contacts)[0]));
  EXPECT_EQ(automatic.touch({contacts[0]})[0].model, PAL_MODEL_POLYNOMIAL);
  automatic.fix({0});
  EXPECT_EQ(automatic.touch({contacts[0]})[0].model, PAL_MODEL_LINEAR);
  automatic.fix({});
  EXPECT_EQ(automatic.touch({contacts[0]})[0].model, PAL_MODEL_POLYNOMIAL);
}

}  // namespace runtime_linear_dd_estimates_test
}  // namespace palpate::test::runtime_linear_dd_fixture
