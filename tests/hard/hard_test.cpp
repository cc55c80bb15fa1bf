// Every hard case ends with finite answers, and says so if an answer is wrong. Tests of the judge break it on
// purpose.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>

#include "tests/hard/hard_cases.hpp"
#include "tests/support/nightly.hpp"

namespace palpate::hard {
namespace {

std::vector<Case> cases_of_this_run() {
  std::vector<Case> cases;
  for (const Group& group : all_groups()) {
    for (const Case& one : group.cases) {
      if (!one.slow || test::is_nightly()) cases.push_back(one);
    }
  }
  return cases;
}

class HardCase : public ::testing::TestWithParam<Case> {};

TEST_P(HardCase, IsAnsweredWithinItsBarOrSaysThatItIsNot) {
  const Case& one = GetParam();
  const Outcome outcome = run_case(one);
  for (const Answer& answer : outcome.answers) {
    EXPECT_TRUE(is_sound(answer.verdict))
        << answer.by << ": " << answer.happened << ", displacement error " << answer.displacement_error
        << " (estimate " << answer.estimated_displacement_error << "), force error " << answer.force_error
        << " (estimate " << answer.estimated_force_error << ")";
  }
  EXPECT_TRUE(is_as_expected(one, outcome.verdict))
      << words_for(outcome.verdict) << ": " << outcome.answers.front().happened;
}

INSTANTIATE_TEST_SUITE_P(All, HardCase, ::testing::ValuesIn(cases_of_this_run()),
                         [](const auto& one) { return one.param.group + "_" + one.param.name; });

Case case_of(std::function<std::vector<Answer>()> run) {
  return {"judge", "one", "", {0.01, 0.01}, Expected::answer, "", std::move(run)};
}

Answer with_errors(double displacement, double force) {
  Answer answer;
  answer.displacement_error = displacement;
  answer.force_error = force;
  return answer;
}

TEST(Judge, FindsSilentErrors) {
  const Bar bar = {0.01, 0.02};
  EXPECT_EQ(judge(with_errors(0.009, 0.019), bar), Verdict::answered);
  EXPECT_EQ(judge(with_errors(0.009, 0.021), bar), Verdict::silent);
  EXPECT_EQ(judge(with_errors(0.011, 0.019), bar), Verdict::silent);
  EXPECT_EQ(judge(with_errors(Answer::kNotMeasured, 0.0), bar), Verdict::silent);
  Answer flagged = with_errors(0.5, 0.5);
  flagged.flags = {"extrapolated"};
  EXPECT_EQ(judge(flagged, bar), Verdict::flagged);
  flagged.finite = false;
  EXPECT_EQ(judge(flagged, bar), Verdict::not_finite);
  Answer estimated = with_errors(0.05, 0.05);
  estimated.estimated_displacement_error = 0.03;
  EXPECT_EQ(judge(estimated, bar), Verdict::silent) << "nothing is said of the force";
  estimated.estimated_force_error = 0.03;
  EXPECT_EQ(judge(estimated, bar), Verdict::estimated);
  estimated.force_error = 0.07;
  EXPECT_EQ(judge(estimated, bar), Verdict::silent) << "more than twice what it says";
}

TEST(Judge, OneUnsoundAnswerIsThatOfTheCase) {
  const Outcome outcome = run_case(case_of([] {
    return std::vector<Answer>{with_errors(0, 0), with_errors(0.5, 0)};
  }));
  EXPECT_EQ(outcome.verdict, Verdict::silent);
  EXPECT_FALSE(is_as_expected(case_of({}), outcome.verdict));
  EXPECT_FALSE(is_as_expected(case_of({}), Verdict::refused));
  EXPECT_EQ(run_case(case_of([] { return std::vector<Answer>(); })).verdict, Verdict::silent);
}

TEST(Judge, SeesCrashesAndHangs) {
  EXPECT_EQ(run_apart(case_of([]() -> std::vector<Answer> { _exit(3); }), 60).verdict, Verdict::crashed);
  EXPECT_EQ(run_apart(case_of([]() -> std::vector<Answer> { std::abort(); }), 60).verdict, Verdict::crashed);
  EXPECT_EQ(run_apart(case_of([]() -> std::vector<Answer> {
                        while (true) pause();
                      }),
                      0.2)
                .verdict,
            Verdict::hung);
  EXPECT_EQ(run_apart(case_of([]() -> std::vector<Answer> { throw std::runtime_error("no"); }), 60).verdict,
            Verdict::refused);
  const Outcome good = run_apart(case_of([] { return std::vector<Answer>{with_errors(0.001, 0.002)}; }), 60);
  EXPECT_EQ(good.verdict, Verdict::answered);
  EXPECT_EQ(good.answers.front().force_error, 0.002);
}

}  // namespace
}  // namespace palpate::hard
