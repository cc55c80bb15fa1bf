// A hard case: its difficulty, its request, and the judgement of its answers.
//
// An answer is wrong if its error exceeds the case's bar. A wrong answer is *silent* without a flag and with
// an error above twice its own estimate. The estimate bounds 95 of 100 errors. No case may have an answer
// that is silent, missing or not finite.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace palpate::hard {

// The expected outcome of a case.
enum class Expected {
  answer,   // within its bar
  nothing,  // impossible input: refused, or flagged
  limit     // beyond the system's range: flagged or refused, for `reason`
};

enum class Verdict {
  answered,     // within the bar
  flagged,      // beyond the bar or not measured, with a flag
  estimated,    // beyond the bar, with an estimate that covers the error
  refused,      // with a reason
  not_present,  // the input is not on this machine
  silent,       // beyond the bar, without a flag or a true estimate
  not_finite,
  crashed,
  hung
};

const char* words_for(Verdict verdict);

// Whether a case may end with this verdict.
inline bool is_sound(Verdict verdict) {
  return verdict <= Verdict::not_present;
}

// The response of one part of the system to a case.
struct Answer {
  static constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

  std::string by;        // "solve", "build", "auto", "linear", "polynomial", "zone", ...
  std::string happened;  // in words, or the message of the refusal
  bool refused = false;
  bool present = true;
  bool finite = true;
  double displacement_error = kNotMeasured;  // over the largest |d|
  double force_error = kNotMeasured;
  double estimated_displacement_error = 0;  // the answer's own estimate; 1 means unknown
  double estimated_force_error = 0;
  std::vector<std::string> flags;
  Verdict verdict = Verdict::silent;  // set by judge()
};

Answer refused(const std::string& by, const std::string& reason);

// Largest ratio of an error to its estimate: at most 1 for a true estimate.
double over_estimate(const Answer& answer);

struct Bar {
  double displacement = 0.01;
  double force = 0.01;
};

struct Case {
  std::string group;
  std::string name;  // [a-z0-9_], part of the test's name
  std::string hard;  // the difficulty, and how the case is made
  Bar bar;
  Expected expected = Expected::answer;
  std::string reason;  // reason of a limit
  std::function<std::vector<Answer>()> run;
  bool slow = false;  // only in `./dev hard` and nightly runs
};

// Judges `answer` against a bar.
Verdict judge(const Answer& answer, const Bar& bar);

// Runs a case and judges its answers. An exception counts as a refusal. The first answer is the user's
// default and decides the verdict, unless another answer is unsound.
struct Outcome {
  std::vector<Answer> answers;
  Verdict verdict = Verdict::silent;
  double seconds = 0;
};
Outcome run_case(const Case& one);

// Runs a case in its own process, which may crash or exceed `patience` seconds.
Outcome run_apart(const Case& one, double patience_seconds);

// Whether a case ended with its expected outcome.
bool is_as_expected(const Case& one, Verdict verdict);

}  // namespace palpate::hard
