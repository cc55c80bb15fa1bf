#include "tests/hard/hard_case.hpp"

#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace palpate::hard {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

Verdict verdict_of(const std::vector<Answer>& answers) {
  if (answers.empty()) return Verdict::silent;
  for (const Answer& answer : answers) {
    if (!is_sound(answer.verdict)) return answer.verdict;
  }
  return answers.front().verdict;
}

// JSON has no NaN or infinity: such numbers become null.
nlohmann::json number(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
}
double number_in(const nlohmann::json& value) {
  return value.is_null() ? Answer::kNotMeasured : value.get<double>();
}

std::string written(const Outcome& outcome) {
  nlohmann::json answers = nlohmann::json::array();
  for (const Answer& a : outcome.answers) {
    answers.push_back({a.by, a.happened, a.refused, a.present, a.finite, number(a.displacement_error),
                       number(a.force_error), a.estimated_displacement_error, a.estimated_force_error,
                       a.flags, static_cast<int>(a.verdict)});
  }
  return answers.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::vector<Answer> read(const std::string& text) {
  std::vector<Answer> answers;
  for (const nlohmann::json& row : nlohmann::json::parse(text)) {
    answers.push_back({row[0], row[1], row[2], row[3], row[4], number_in(row[5]), number_in(row[6]), row[7],
                       row[8], row[9], static_cast<Verdict>(row[10].get<int>())});
  }
  return answers;
}

// Reads a pipe until its end or the deadline. Returns whether the end came.
bool read_pipe(int pipe, double seconds, std::string& text) {
  const Clock::time_point start = Clock::now();
  char buffer[4096];
  while (true) {
    const double left = seconds - seconds_since(start);
    pollfd waited = {pipe, POLLIN, 0};
    if (left <= 0 || poll(&waited, 1, static_cast<int>(1000 * left) + 1) == 0) return false;
    const ssize_t count = ::read(pipe, buffer, sizeof buffer);
    if (count <= 0) return true;
    text.append(buffer, static_cast<size_t>(count));
  }
}

Outcome without_answer(Verdict verdict, const std::string& happened) {
  Answer answer;
  answer.happened = happened;
  answer.verdict = verdict;
  return {{answer}, verdict, 0};
}

}  // namespace

const char* words_for(Verdict verdict) {
  switch (verdict) {
    case Verdict::answered:
      return "answered";
    case Verdict::flagged:
      return "flagged";
    case Verdict::estimated:
      return "estimated";
    case Verdict::refused:
      return "refused";
    case Verdict::not_present:
      return "not present";
    case Verdict::silent:
      return "WRONG IN SILENCE";
    case Verdict::not_finite:
      return "NOT FINITE";
    case Verdict::crashed:
      return "CRASHED";
    case Verdict::hung:
      return "HUNG";
  }
  return "";
}

Answer refused(const std::string& by, const std::string& reason) {
  Answer answer;
  answer.by = by;
  answer.happened = reason;
  answer.refused = true;
  return answer;
}

double over_estimate(const Answer& answer) {
  const auto ratio = [](double error, double estimate) {
    return error > 0 ? error / estimate : error == 0 ? 0 : Answer::kNotMeasured;
  };
  const double displacement = ratio(answer.displacement_error, answer.estimated_displacement_error);
  if (std::isnan(answer.force_error)) return displacement;
  return std::max(displacement, ratio(answer.force_error, answer.estimated_force_error));
}

Verdict judge(const Answer& answer, const Bar& bar) {
  if (!answer.present) return Verdict::not_present;
  if (answer.refused) return Verdict::refused;
  if (!answer.finite) return Verdict::not_finite;
  const auto is_within = [](double error, double bound) { return error <= bound; };  // false for NaN
  const bool has_force = !std::isnan(answer.force_error);
  if (is_within(answer.displacement_error, bar.displacement) &&
      (!has_force || is_within(answer.force_error, bar.force)))
    return Verdict::answered;
  // Estimates cover 95 of 100 errors; cases are chosen among the rest.
  constexpr double kMostOverEstimate = 2;
  const bool is_covered = is_within(over_estimate(answer), kMostOverEstimate);
  if (!answer.flags.empty()) return Verdict::flagged;
  return is_covered ? Verdict::estimated : Verdict::silent;
}

Outcome run_case(const Case& one) {
  Outcome outcome;
  const Clock::time_point start = Clock::now();
  try {
    outcome.answers = one.run();
  } catch (const std::exception& error) {
    outcome.answers = {refused("build", error.what())};
  }
  for (Answer& answer : outcome.answers) answer.verdict = judge(answer, one.bar);
  outcome.verdict = verdict_of(outcome.answers);
  outcome.seconds = seconds_since(start);
  return outcome;
}

Outcome run_apart(const Case& one, double patience_seconds) {
  const Clock::time_point start = Clock::now();
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    close(ends[0]);
    const std::string text = written(run_case(one));
    for (size_t at = 0; at < text.size();) {
      const ssize_t count = write(ends[1], text.data() + at, text.size() - at);
      if (count <= 0) _exit(1);
      at += static_cast<size_t>(count);
    }
    _exit(0);
  }
  close(ends[1]);
  std::string text;
  const bool has_ended = read_pipe(ends[0], patience_seconds, text);
  close(ends[0]);
  if (!has_ended) kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  Outcome outcome;
  if (!has_ended) {
    outcome = without_answer(Verdict::hung, "no answer in time");
  } else if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    outcome = without_answer(Verdict::crashed, "the process ended");
  } else {
    outcome.answers = read(text);
    outcome.verdict = verdict_of(outcome.answers);
  }
  outcome.seconds = seconds_since(start);
  return outcome;
}

bool is_as_expected(const Case& one, Verdict verdict) {
  if (verdict == Verdict::not_present) return true;
  switch (one.expected) {
    case Expected::answer:
      return verdict == Verdict::answered;
    case Expected::nothing:
    case Expected::limit:
      return verdict == Verdict::flagged || verdict == Verdict::estimated || verdict == Verdict::refused;
  }
  return false;
}

}  // namespace palpate::hard
