// Surveys of several contacts: the choice of contact sets, their storage, and the table of errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "offline/precompute/set_survey.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate::test {
namespace contact_sets_test {

constexpr double kMost = 0.1;
constexpr std::uint64_t kSeed = 4;

// Twenty-five sites on the top of a block, each alone or with its neighbours.
TouchedBlock block_of(int max_contacts, double tip_radius = 0) {
  TouchedBlock block = touched_block(6, tip_radius);
  block.scene.max_contacts = max_contacts;
  block.scene.max_displacement = kMost;
  return block;
}

std::vector<ContactSet> drawn(const TouchedBlock& block, int count, std::uint64_t seed = kSeed) {
  return draw_contact_sets(block.model, block.scene, block.sites, count, seed);
}

double distance(const TouchedBlock& block, size_t a, size_t b) {
  const auto place = [&](size_t site) {
    return block.model.positions[static_cast<size_t>(block.sites.sites[site].node)];
  };
  return (place(a) - place(b)).norm();
}

bool share_a_node(const TouchedBlock& block, size_t a, size_t b) {
  const std::vector<int>& one = block.sites.sites[a].patch;
  const std::vector<int>& other = block.sites.sites[b].patch;
  return std::any_of(one.begin(), one.end(), [&](int node) { return std::ranges::count(other, node) > 0; });
}

TEST(ContactSets, AreOfEveryKindThatTheSceneHas) {
  EXPECT_TRUE(drawn(block_of(1), 40).empty());
  EXPECT_TRUE(drawn(block_of(3), 0).empty());
  std::map<SetKind, int> of_two;
  for (const ContactSet& set : drawn(block_of(2), 40)) ++of_two[set.kind];
  EXPECT_EQ(of_two, (std::map<SetKind, int>{{SetKind::two_near, 20}, {SetKind::two_anywhere, 20}}));
  std::map<SetKind, int> of_four;
  for (const ContactSet& set : drawn(block_of(4), 40)) {
    ++of_four[set.kind];
    EXPECT_EQ(set.contacts.size(), static_cast<size_t>(num_contacts_of(set.kind)));
  }
  EXPECT_EQ(of_four.size(), 4U);
  for (const auto& [kind, count] : of_four) EXPECT_EQ(count, 10) << words_for(kind);
}

TEST(ContactSets, HoldNoNodeTwiceAndAreNearOrApart) {
  const TouchedBlock block = block_of(3, 0.18);
  double nearest_of_near = 0;
  double nearest_of_apart = 1;
  for (const ContactSet& set : drawn(block, 60)) {
    double least = 1;
    for (size_t i = 0; i < set.contacts.size(); ++i) {
      for (size_t j = 0; j < i; ++j) {
        const size_t a = set.contacts[i].site;
        const size_t b = set.contacts[j].site;
        EXPECT_FALSE(share_a_node(block, a, b));
        least = std::min(least, distance(block, a, b));
      }
      EXPECT_LE(set.contacts[i].displacement.norm(), kMost * (1 + 1e-12));
      EXPECT_GT(set.contacts[i].displacement.norm(), 0);
    }
    if (is_near(set.kind)) nearest_of_near = std::max(nearest_of_near, least);
    if (set.kind == SetKind::three_apart) nearest_of_apart = std::min(nearest_of_apart, least);
    if (set.kind != SetKind::two_near) continue;
    // No other site that could be the second contact is nearer to the first.
    const size_t first = set.contacts[0].site;
    for (size_t site = 0; site < block.sites.sites.size(); ++site) {
      if (share_a_node(block, first, site)) continue;
      EXPECT_GE(distance(block, first, site), distance(block, first, set.contacts[1].site));
    }
  }
  EXPECT_LT(nearest_of_near, nearest_of_apart);
}

TEST(ContactSets, DependOnTheirSeedAlone) {
  const TouchedBlock block = block_of(3);
  const std::vector<ContactSet> sets = drawn(block, 24);
  const std::vector<ContactSet> again = drawn(block, 24);
  const std::vector<ContactSet> others = drawn(block, 24, kSeed + 1);
  std::set<double> sizes;
  for (size_t i = 0; i < sets.size(); ++i) {
    for (size_t c = 0; c < sets[i].contacts.size(); ++c) {
      EXPECT_EQ(sets[i].contacts[c].site, again[i].contacts[c].site);
      EXPECT_EQ(sets[i].contacts[c].displacement, again[i].contacts[c].displacement);
      EXPECT_NE(sets[i].contacts[c].displacement, others[i].contacts[c].displacement);
      sizes.insert(std::floor(4 * sets[i].contacts[c].displacement.norm() / kMost));
    }
  }
  EXPECT_GE(sizes.size(), 4U) << "every quarter of the range";
}

TEST(ContactSets, InwardScenesPushInward) {
  TouchedBlock block = block_of(2);
  block.scene.directions = Directions::inward;
  for (const ContactSet& set : drawn(block, 20)) {
    for (const LinearContact& contact : set.contacts)
      EXPECT_GE(contact.displacement.dot(block.sites.sites[contact.site].inward), -1e-12);
  }
}

TEST(ContactSets, PatchesThatAllOverlapLeaveNone) {
  EXPECT_TRUE(drawn(block_of(3, 5.0), 20).empty());
}

// A build reuses stored solves, and neither they nor the number of threads change a digit.
TEST(ContactSets, AreReusedAsTheyWereSolved) {
  TouchedBlock block = touched_block(4, 0);
  block.scene.max_contacts = 3;
  const Assembly assembly(block.model, block.model.fixed_dofs());
  const std::vector<ContactSet> sets = drawn(block, 8);
  const TempDir dir;
  const SampleStore store(dir.path() / "kept", "a key");
  const auto solved = [&](int jobs, const SampleStore* where) {
    return solve_drawn_sets(assembly, block.sites, {}, sets, jobs, where, {});
  };
  const SolvedSets plain = solved(2, nullptr);
  EXPECT_EQ(plain.counts.solves, 8);
  EXPECT_GT(plain.counts.iterations, 8);
  EXPECT_GT(plain.counts.factorizations, 7);
  // Two solves are in the store first, as after a killed build.
  size_t next = 0;
  const SolvedSets begun = solve_drawn_sets(assembly, block.sites, {}, sets, 1, &store, {},
                                            [&] { return next < 2 ? next++ : sets.size(); });
  EXPECT_EQ(begun.counts.solves, 2);
  EXPECT_FALSE(begun.truths[5].solved);
  const SolvedSets resumed = solved(1, &store);
  EXPECT_EQ(resumed.counts.reused, 2);
  EXPECT_EQ(resumed.counts.solves, 6);
  const SolvedSets kept = solved(2, &store);
  EXPECT_EQ(kept.counts.reused, 8);
  EXPECT_EQ(kept.counts.solves, 0);
  std::vector<std::vector<LinearContact>> contacts;
  for (const ContactSet& set : sets) contacts.push_back(set.contacts);
  const std::vector<ContactTruth> exact = solve_contact_sets(assembly, block.sites, contacts, 1, {});
  for (size_t i = 0; i < sets.size(); ++i) {
    ASSERT_EQ(plain.truths[i].solved, exact[i].solved);
    for (const SolvedSets* other : {&resumed, &kept}) {
      EXPECT_EQ(other->truths[i].solved, plain.truths[i].solved);
      EXPECT_EQ(other->truths[i].field, plain.truths[i].field);
      EXPECT_EQ(other->truths[i].forces, plain.truths[i].forces);
    }
    if (!exact[i].solved) continue;
    EXPECT_EQ(plain.truths[i].forces, exact[i].forces);
    constexpr double kSingle = 1e-7;
    EXPECT_LE((plain.truths[i].field - exact[i].field).norm(), kSingle * exact[i].field.norm());
  }
}

SetAnswer answer(SetKind kind, double error, bool is_solved = true, bool is_flagged = false,
                 double load = 0.5, double reach = 0.25) {
  return {kind, is_solved, is_flagged, error, 2 * error, load, reach};
}

TEST(SetSurvey, CountsAnswersAndBoundsErrorsWithoutAFlag) {
  const SetKind kind = SetKind::two_near;
  std::vector<SetAnswer> answers;
  for (int i = 1; i <= 20; ++i) answers.push_back(answer(kind, 0.01 * i));
  answers.push_back(answer(kind, 0.9, true, true));   // wrong, with a flag
  answers.push_back(answer(kind, 1.0, false, true));  // no response, with a flag
  answers.push_back(answer(SetKind::three_apart, 0.4));
  const SetSurvey survey = tabulate_sets(answers);
  ASSERT_EQ(survey.kinds.size(), 2U);
  EXPECT_EQ(survey.kinds[0].kind, kind);
  EXPECT_EQ(survey.kinds[0].sets, 22);
  EXPECT_EQ(survey.kinds[0].flagged, 2);
  EXPECT_EQ(survey.kinds[0].unsolved, 1);
  EXPECT_EQ(survey.kinds[0].displacement.max, 0.9) << "a flagged answer is an answer";
  EXPECT_NEAR(survey.kinds[0].displacement.median, 0.11, 1e-12);
  EXPECT_EQ(survey.kinds[1].displacement.median, 0.4);
  // With few samples the bound is the largest error, over its load and over its reach.
  EXPECT_NEAR(survey.over_load.displacement, 0.4 / 0.5, 1e-12);
  EXPECT_NEAR(survey.over_load.force, 0.8 / 0.5, 1e-12);
  EXPECT_NEAR(survey.over_reach.displacement, 0.4 / 0.25, 1e-12);
  EXPECT_NEAR(survey.over_reach.force, 0.8 / 0.25, 1e-12);
  // A response without a flag where no equilibrium exists counts as an error of 1.
  answers.push_back(answer(kind, 1.0, false, false));
  const SetSurvey silent = tabulate_sets(answers);
  EXPECT_EQ(silent.kinds[0].displacement.max, 1.0);
  EXPECT_NEAR(silent.over_load.displacement, 1 / 0.5, 1e-12);
  for (const SetSurvey& nothing : {tabulate_sets({}), tabulate_sets({answer(kind, 0.9, true, true)})}) {
    for (const SetBounds& bounds : {nothing.over_load, nothing.over_reach}) {
      EXPECT_EQ(bounds.displacement, 0) << "nothing to estimate from";
      EXPECT_EQ(bounds.force, 0);
    }
  }
  // The largest error over its set's size, which may differ from the largest error. A set at rest adds no
  // rounding.
  const SetSurvey uneven =
      tabulate_sets({answer(kind, 0.4, true, false, 0.5, 2), answer(kind, 0.3, true, false, 1, 1),
                     answer(kind, 1e-5, true, false, 0, 0)});
  EXPECT_NEAR(uneven.over_load.displacement, 0.8, 1e-12);
  EXPECT_NEAR(uneven.over_reach.displacement, 0.3, 1e-12);
}

}  // namespace contact_sets_test
}  // namespace palpate::test
