// The store of solves on disk returns each solve to the bit, and ignores every incomplete record.
#include "offline/precompute/sample_store.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <stdexcept>
#include <string>

#include "offline/precompute/site_survey.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate::test {
namespace sample_store_test {

const PushRequest kRequest = {PushRequest::Kind::sample, 0, {0.1, -0.2, 1e-300}};

SolvedPush push_of(double number) {
  return {PushOutcome::solved, {number, 1.0 / 3}, {1.5f, -0.0f, 3e38f}};
}

struct StoredSolves : ::testing::Test {
  std::filesystem::path path() const { return dir.path() / "7.samples"; }
  TempDir dir;
};

TEST_F(StoredSolves, AreFoundAgainToTheBit) {
  {
    SampleFile file(path());
    EXPECT_FALSE(file.find(kRequest, 2, 3).has_value());
    EXPECT_TRUE(file.keep(kRequest, push_of(2.5)));
    EXPECT_TRUE(file.keep({PushRequest::Kind::survey, 2, kRequest.displacement},
                          {PushOutcome::no_equilibrium, {}, {}}));
  }
  const SampleFile file(path());
  const auto found = file.find(kRequest, 2, 3);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->outcome, PushOutcome::solved);
  EXPECT_EQ(found->numbers, push_of(2.5).numbers);
  EXPECT_EQ(found->fields, push_of(2.5).fields);
  const auto unsolved = file.find({PushRequest::Kind::survey, 2, kRequest.displacement}, 9, 9);
  ASSERT_TRUE(unsolved.has_value()) << "that there was no equilibrium is worth keeping";
  EXPECT_EQ(unsolved->outcome, PushOutcome::no_equilibrium);
  // The request differs in the last digit.
  EXPECT_FALSE(file.find({PushRequest::Kind::survey, 1, kRequest.displacement}, 2, 3).has_value());
  EXPECT_FALSE(file.find({PushRequest::Kind::sample, 0, {0.1, -0.2, 2e-300}}, 2, 3).has_value());
  EXPECT_FALSE(file.find(kRequest, 2, 4).has_value()) << "an organ of another size";
}

// A file copied to another site's name, or into another scene's folder.
TEST_F(StoredSolves, AreThoseOfTheirSiteAndScene) {
  const SampleStore store(dir.path() / "kept", "a scene");
  const SampleStore other(dir.path() / "kept", "another scene");
  EXPECT_TRUE(SampleFile(store.file_of(7), store.binding_of(7)).keep(kRequest, push_of(1)));
  EXPECT_TRUE(SampleFile(store.file_of(7), store.binding_of(7)).find(kRequest, 2, 3).has_value());
  EXPECT_FALSE(SampleFile(store.file_of(7), store.binding_of(8)).find(kRequest, 2, 3).has_value());
  EXPECT_FALSE(SampleFile(store.file_of(7), other.binding_of(7)).find(kRequest, 2, 3).has_value());
}

TEST(StoredSolvesOfAFullDisk, AreReportedAsNotStored) {
  SampleFile file("/dev/full");
  EXPECT_FALSE(file.keep(kRequest, push_of(1)));
  EXPECT_FALSE(file.find(kRequest, 2, 3).has_value());
}

// A record's claimed length never makes the store read past the file's end.
TEST_F(StoredSolves, AnAbsurdLengthIsNoRecord) {
  EXPECT_TRUE(SampleFile(path()).keep(kRequest, push_of(1)));
  for (const int number : {48, 56}) {  // offsets of the counts of numbers and fields
    for (const std::uint64_t absurd : {std::uint64_t{1} << 28, ~std::uint64_t{0}}) {
      std::fstream file(path(), std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(number);
      file.write(reinterpret_cast<const char*>(&absurd), sizeof absurd);
      file.close();
      EXPECT_FALSE(SampleFile(path()).find(kRequest, 2, 3).has_value());
    }
  }
}

// A kill at any point of a write: earlier records stay, and the next record takes the place of the partial
// record.
TEST_F(StoredSolves, HalfARecordIsNone) {
  {
    SampleFile file(path());
    EXPECT_TRUE(file.keep(kRequest, push_of(1)));
    EXPECT_TRUE(file.keep({PushRequest::Kind::sample, 0, {1, 2, 3}}, push_of(2)));
  }
  const auto whole = std::filesystem::file_size(path());
  for (const auto cut : {whole - 1, whole / 2 + 1, whole / 2 + 40, whole / 2 + 80}) {
    std::filesystem::resize_file(path(), cut);
    SampleFile file(path());
    EXPECT_TRUE(file.find(kRequest, 2, 3).has_value());
    EXPECT_FALSE(file.find({PushRequest::Kind::sample, 0, {1, 2, 3}}, 2, 3).has_value()) << cut;
    EXPECT_TRUE(file.keep({PushRequest::Kind::sample, 0, {1, 2, 3}}, push_of(2)));
    EXPECT_TRUE(SampleFile(path()).find({PushRequest::Kind::sample, 0, {1, 2, 3}}, 2, 3).has_value());
    EXPECT_EQ(std::filesystem::file_size(path()), whole);
  }
}

TEST_F(StoredSolves, DamageIsSeen) {
  EXPECT_TRUE(SampleFile(path()).keep(kRequest, push_of(1)));
  const auto bytes = static_cast<std::streamoff>(std::filesystem::file_size(path()));
  for (std::streamoff at = 0; at < bytes; ++at) {
    const auto flip = [&] {
      std::fstream file(path(), std::ios::in | std::ios::out | std::ios::binary);
      file.seekg(at);
      const int byte = file.get();
      file.seekp(at);
      file.put(static_cast<char>(byte ^ 0x10));
    };
    flip();
    EXPECT_FALSE(SampleFile(path()).find(kRequest, 2, 3).has_value()) << at;
    flip();
  }
  EXPECT_TRUE(SampleFile(path()).find(kRequest, 2, 3).has_value());
}

TEST_F(StoredSolves, OneBuildAtATime) {
  const SampleStore store(dir.path(), "a scene");
  EXPECT_THROW(SampleStore(dir.path(), "a scene"), std::runtime_error);
  const SampleStore other(dir.path(), "another scene");
  EXPECT_NE(store.file_of(3), other.file_of(3));
}

TEST_F(StoredSolves, AFolderThatCannotBeIsRefused) {
  dir.write("file", "");
  EXPECT_THROW(SampleStore(dir.path() / "file", "a scene"), std::runtime_error);
}

// A resumed build gives the result of an uninterrupted build and solves only the rest. A finer target reuses
// a coarser target's solves.
TEST_F(StoredSolves, ASurveyGoesOnWhereItWas) {
  TouchedBlock block = touched_block(3, 0.4);
  const Assembly assembly(block.model, block.model.fixed_dofs());
  const LinearDd linear = compute_linear_dd(assembly, block.sites);
  SamplingPlan plan;
  plan.least_samples = 6;
  plan.most_samples = 12;
  plan.survey_samples = 4;
  const auto sampled = [&](const SamplingPlan& as, const SampleStore* store) {
    return sample_sites(assembly, block.scene, block.sites, linear, as, {}, RestState(), store).front();
  };
  const auto expect_same = [](const SiteResult& one, const SiteResult& other) {
    EXPECT_EQ(one.polynomial.basis, other.polynomial.basis);
    EXPECT_EQ(one.polynomial.energy, other.polynomial.energy);
    EXPECT_EQ(one.min_jacobian, other.min_jacobian);
    ASSERT_EQ(one.survey.size(), other.survey.size());
    for (size_t i = 0; i < one.survey.size(); ++i) {
      EXPECT_EQ(one.survey[i].truth.field, other.survey[i].truth.field);
      EXPECT_EQ(one.survey[i].truth.force, other.survey[i].truth.force);
    }
  };
  const SiteResult alone = sampled(plan, nullptr);
  const SampleStore store(dir.path(), "a scene");
  const SiteResult kept = sampled(plan, &store);
  expect_same(alone, kept);
  EXPECT_EQ(kept.counts.reused, 0);
  const SiteResult again = sampled(plan, &store);
  expect_same(alone, again);
  EXPECT_EQ(again.counts.solves, 0);
  EXPECT_EQ(again.counts.reused, kept.counts.solves);

  // Killed after about half of the solves.
  const int label = block.model.labels[static_cast<size_t>(block.sites.sites.front().node)];
  std::filesystem::resize_file(store.file_of(label), std::filesystem::file_size(store.file_of(label)) / 2);
  const SiteResult resumed = sampled(plan, &store);
  expect_same(alone, resumed);
  EXPECT_GT(resumed.counts.reused, 0);
  EXPECT_GT(resumed.counts.solves, 0);

  SamplingPlan finer = plan;
  finer.target = 1e-9;
  const SiteResult longer = sampled(finer, &store);
  expect_same(sampled(finer, nullptr), longer);
  EXPECT_EQ(longer.samples, 12U);
  EXPECT_EQ(longer.counts.solves, static_cast<long>(longer.samples - alone.samples));
}

}  // namespace sample_store_test
}  // namespace palpate::test
