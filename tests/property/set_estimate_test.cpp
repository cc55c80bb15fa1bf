// A session's error estimates for several contacts: the pack's survey of contact sets, and none where the
// survey has no data.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/src/linear/linear_point.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"

namespace palpate::test {
namespace set_estimate_test {

constexpr double kMost = 0.05;
constexpr double kBound = 0.3;
constexpr double kForceBound = 0.2;
constexpr double kSingle = 0.01;  // of a contact in the innermost bin; doubles from bin to bin

// A pack with a zone and with the given surveys.
AlignedBytes surveyed_pack(const SetBounds& over_load = {kBound, kForceBound},
                           const SetBounds& over_reach = {}) {
  const SmallPack& small = small_pack();
  PackContent content = small.content();
  content.zone = &small.zone;
  content.surveys = {{SurveyedModel::linear_dd, small.surveys[0].table},
                     {SurveyedModel::polynomial_dd, small.surveys[1].table},
                     {SurveyedModel::unrefined_zone, small.surveys[0].table}};
  for (ModelSurvey& survey : content.surveys) {
    for (size_t bin = 0; bin < survey.table.bins.size(); ++bin) {
      survey.table.bins[bin].displacement.bound = kSingle * static_cast<double>(bin + 1);
      survey.table.bins[bin].force.bound = kSingle * static_cast<double>(bin + 1);
    }
    if (survey.model == SurveyedModel::polynomial_dd) continue;
    survey.sets.kinds = {{SetKind::two_near, 9, 0, 0, {}, {}}};
    survey.sets.over_load = over_load;
    survey.sets.over_reach = over_reach;
  }
  return write_pack(content);
}

pal_contact push_at(uint32_t site, const Eigen::Vector3d& d) {
  return {site, {d[0], d[1], d[2]}, 0, {}, {}, {}};
}

class SetEstimate : public ::testing::Test {
 protected:
  // Results after convergence.
  static std::vector<pal_contact_result> settled(const OpenPack& pack, pal_model model,
                                                 const std::vector<pal_contact>& contacts) {
    OwnedSession session(pack.get(), model, 3, 2);
    std::vector<pal_contact_result> results;
    for (int frame = 0; frame < 60; ++frame) results = session.touch(contacts);
    return results;
  }

  std::vector<pal_contact_result> settled(pal_model model, const std::vector<pal_contact>& contacts) const {
    return settled(pack_, model, contacts);
  }

  // The load of contacts at `one_` and `other_`.
  double load(const std::vector<pal_contact_result>& results) const {
    const auto scale = [&](uint32_t site) { return kMost * patch_stiffness_norm(*pack_.get(), site); };
    return std::max(Eigen::Vector3d(results[0].force).norm() / scale(one_),
                    Eigen::Vector3d(results[1].force).norm() / scale(other_));
  }

  const SmallPack& small_ = small_pack();
  const AlignedBytes bytes_ = surveyed_pack();
  const OpenPack pack_{bytes_};
  // Two sites far apart on the top.
  const uint32_t one_ = small_.site_at(50);
  const uint32_t other_ = small_.site_at(63);
};

void expect_estimate(const pal_contact_result& result, double displacement, double force) {
  EXPECT_EQ(result.flags, uint32_t{PAL_FLAG_UNREFINED});
  EXPECT_NEAR(result.displacement_error, displacement, 1e-12);
  EXPECT_NEAR(result.force_error, force, 1e-12);
}

TEST_F(SetEstimate, GrowsWithTheForcesOfZones) {
  for (const double part : {0.1, 0.4, 0.8}) {
    const auto results = settled(
        PAL_MODEL_ZONE, {push_at(one_, {0, 0, -part * kMost}), push_at(other_, {0, 0.5 * part * kMost, 0})});
    const double single = kSingle * std::ceil(4 * part);
    for (const pal_contact_result& result : results)
      expect_estimate(result, std::max(single, kBound * load(results)),
                      std::max(single, kForceBound * load(results)));
  }
}

// The sum of (|d| / max_displacement)^2, whatever the forces.
TEST_F(SetEstimate, GrowsWithTheSquareOfTheReach) {
  constexpr double kNothing = 1e-9;  // zero would mean "no estimate"
  const SetBounds over_reach = {0.3, 0.2};
  const AlignedBytes bytes = surveyed_pack({kNothing, kNothing}, over_reach);
  const OpenPack pack(bytes);
  for (const double part : {0.4, 0.7, 0.99}) {
    const double reach = 1.25 * part * part;
    ASSERT_GT(over_reach.force * reach, kSingle * std::ceil(4 * part)) << "what one contact has";
    for (const pal_contact_result& result :
         settled(pack, PAL_MODEL_ZONE,
                 {push_at(one_, {0, 0, -part * kMost}), push_at(other_, {0, 0.5 * part * kMost, 0})}))
      expect_estimate(result, over_reach.displacement * reach, over_reach.force * reach);
  }
}

TEST_F(SetEstimate, IsNotKnownWhereNothingWasMeasured) {
  const pal_contact small_push = push_at(one_, {0, 0, -0.2 * kMost});
  const auto expect_unknown = [](const std::vector<pal_contact_result>& results) {
    for (const pal_contact_result& result : results) {
      EXPECT_EQ(result.displacement_error, 1);
      EXPECT_EQ(result.force_error, 1);
    }
  };
  for (const pal_model model : {PAL_MODEL_LINEAR, PAL_MODEL_ZONE}) {
    // More contacts than any surveyed set.
    expect_unknown(
        settled(model, {small_push, push_at(other_, {0, 0, 0}), push_at(small_.site_at(53), {0, 0, 0})}));
    // A contact beyond the domain makes the whole estimate unknown.
    const auto beyond = settled(model, {small_push, push_at(other_, {0, 0, -1.2 * kMost})});
    EXPECT_NE(beyond[1].flags & PAL_FLAG_EXTRAPOLATED, 0U);
    expect_unknown(beyond);
  }
  // The linear model has no estimate for sets.
  expect_unknown(settled(PAL_MODEL_LINEAR, {small_push, push_at(other_, {0, 0, -0.1 * kMost})}));
  OwnedSession fixed(pack_.get(), PAL_MODEL_LINEAR, 3, 2);
  fixed.fix({3});
  expect_unknown(fixed.touch({small_push, push_at(other_, {0, 0, 0.1 * kMost})}));
  pal_contact by_force = small_push;
  by_force.force_axes = 1;
  expect_unknown(settled(PAL_MODEL_LINEAR, {by_force, push_at(other_, {0, 0, 0.1 * kMost})}));
}

// A survey's bound of the whole displacement also sets a flag.
TEST_F(SetEstimate, FlagsSetsOfWhichNothingIsKnown) {
  const std::vector<pal_contact> contacts = {push_at(one_, {0, 0, -0.6 * kMost}),
                                             push_at(other_, {0, 0.3 * kMost, 0})};
  const double load_then = load(settled(PAL_MODEL_ZONE, contacts));
  const double reach = 0.6 * 0.6 + 0.3 * 0.3;
  for (const double part : {0.99, 1.01}) {
    using Bounds = std::pair<SetBounds, SetBounds>;
    for (const auto& [over_load, over_reach] :
         {Bounds{{part / load_then, kForceBound}, {}}, Bounds{{kBound, kForceBound}, {part / reach, 0}}}) {
      const AlignedBytes bytes = surveyed_pack(over_load, over_reach);
      const OpenPack pack(bytes);
      for (const pal_contact_result& result : settled(pack, PAL_MODEL_ZONE, contacts)) {
        EXPECT_EQ(flags_of(result), part > 1 ? uint32_t{PAL_FLAG_EXTRAPOLATED} : 0U);
        EXPECT_EQ(result.force_error < 1, part < 1);
        EXPECT_NEAR(result.displacement_error, std::min(1.0, part), 1e-9);
      }
    }
  }
}

// An older pack, without surveys of sets.
TEST_F(SetEstimate, IsUnknownWithoutASurveyOfSets) {
  const AlignedBytes bytes = small_.write_with_zone();
  const OpenPack pack(bytes);
  for (const pal_model model : {PAL_MODEL_LINEAR, PAL_MODEL_ZONE}) {
    OwnedSession session(pack.get(), model, 3, 0);
    for (const pal_contact_result& result :
         session.touch({push_at(one_, {0, 0, -0.1 * kMost}), push_at(other_, {0, 0, -0.1 * kMost})}))
      EXPECT_EQ(result.displacement_error, 1);
  }
}

}  // namespace set_estimate_test
}  // namespace palpate::test
