// A hard case: what is hard about it, what is asked, and how its answers are judged.
//
// An answer is wrong where its error exceeds the bar of its case. It is *silent* where nothing says so: no flag, and
// the error more than twice its own estimate, which is a bound of 95 of 100 errors. No case may have a silent answer,
// one that is not finite, or none at all.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace palpate::hard {

// What a case asks for.
enum class Expected {
  answer,   // within its bar
  nothing,  // of an input that has no answer: it is refused, or what comes out is flagged
  limit     // what the system cannot do: it is flagged or refused, and `reason` says why
};

enum class Verdict {
  answered,     // within the bar
  flagged,      // beyond it, or not measured, and a flag says so
  estimated,    // beyond it, and the estimate of its error says so
  refused,      // with a reason
  not_present,  // an input that is not on this machine
  silent,       // beyond the bar, and it does not say so
  not_finite,
  crashed,
  hung
};

const char* words_for(Verdict verdict);

// Whether a case may end so.
inline bool is_sound(Verdict verdict) {
  return verdict <= Verdict::not_present;
}

// What one part of the system made of a case.
struct Answer {
  static constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

  std::string by;        // "solve", "build", "auto", "linear", "polynomial", "zone", ...
  std::string happened;  // in words, or the refusal
  bool refused = false;
  bool present = true;
  bool finite = true;
  double displacement_error = kNotMeasured;  // as in DESIGN: over the largest |d|
  double force_error = kNotMeasured;
  double estimated_displacement_error = 0;  // what the answer says of itself; 1: that it is not known
  double estimated_force_error = 0;
  std::vector<std::string> flags;
  Verdict verdict = Verdict::silent;  // by judge()
};

Answer refused(const std::string& by, const std::string& reason);

// Of the errors beside what the answer says of itself: at most 1 where it tells the truth.
double over_estimate(const Answer& answer);

struct Bar {
  double displacement = 0.01;
  double force = 0.01;
};

struct Case {
  std::string group;
  std::string name;  // [a-z0-9_]: of the test
  std::string hard;  // what is hard, and how it is made
  Bar bar;
  Expected expected = Expected::answer;
  std::string reason;  // of a limit
  std::function<std::vector<Answer>()> run;
  bool slow = false;  // for `./dev hard` and a night
};

// Of `answer` beside a bar.
Verdict judge(const Answer& answer, const Bar& bar);

// Runs a case and judges its answers. What it throws is a refusal. The first answer is the one that a user gets by
// default, and decides the verdict of the case, but where another is unsound.
struct Outcome {
  std::vector<Answer> answers;
  Verdict verdict = Verdict::silent;
  double seconds = 0;
};
Outcome run_case(const Case& one);

// The same in a process of its own, which may crash or take longer than this.
Outcome run_apart(const Case& one, double patience_seconds);

// Whether a case came to what it asks for.
bool is_as_expected(const Case& one, Verdict verdict);

}  // namespace palpate::hard
