// Prints the table of hard cases; each case runs in a process of its own.
//
//   palpate_hard_cases DIR [CASE ...]     writes DIR/GROUP.md, DIR/summary.md and DIR/hard_cases.csv
//
// CASE words select the cases whose group_name contains a word. Exit code 1 if a case misses its expected
// outcome.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <map>

#include "bench/solver/study_table.hpp"
#include "offline/fem/blas_kernels.hpp"
#include "tests/hard/hard_cases.hpp"

namespace palpate::hard {
namespace {

constexpr double kPatience = 1200;  // seconds

std::string percent(double error) {
  return std::isnan(error) ? "" : fmt::format("{:.2g}", 100 * error);
}

std::string said(const Answer& answer) {
  std::string text = fmt::format("{}", fmt::join(answer.flags, " "));
  if (answer.estimated_displacement_error >= 1)
    text += text.empty() ? "error not known" : "";
  else if (answer.estimated_displacement_error > 0)
    text +=
        fmt::format("{}estimate {}", text.empty() ? "" : " ", percent(answer.estimated_displacement_error));
  return text;
}

// Text for a cell: no bar, no line end, and no commas in the CSV.
std::string cell(std::string text) {
  std::replace(text.begin(), text.end(), '|', '/');
  std::replace(text.begin(), text.end(), '\n', ' ');
  std::replace(text.begin(), text.end(), ',', ';');
  return text;
}

struct Counts {
  std::map<Verdict, int> of_answers;
  int cases = 0;
  int unsound = 0;
  int not_present = 0;
  int without_answer = 0;
  int refused = 0;  // part of without_answer
  int to_answer = 0;
  int answered = 0;
  std::vector<std::string> cannot;
};

void count(const Case& one, const Outcome& outcome, Counts& counts) {
  ++counts.cases;
  for (const Answer& answer : outcome.answers) ++counts.of_answers[answer.verdict];
  if (outcome.verdict == Verdict::not_present) {
    ++counts.not_present;
    return;
  }
  if (!is_sound(outcome.verdict)) ++counts.unsound;
  if (one.expected == Expected::nothing) {
    ++counts.without_answer;
    counts.refused += outcome.verdict == Verdict::refused ? 1 : 0;
    return;
  }
  ++counts.to_answer;
  if (outcome.verdict == Verdict::answered) {
    ++counts.answered;
  } else {
    counts.cannot.push_back(fmt::format("- *{}*: {}: {}", one.hard, words_for(outcome.verdict),
                                        one.reason.empty() ? outcome.answers.front().happened : one.reason));
  }
}

std::string summary_of(const Counts& counts) {
  std::string text = fmt::format(
      "{} cases. {} have an answer: {} of them ({:.0f} %) are answered within their bar by what answers by "
      "default, {} are "
      "not, and say so. {} are no question: {} of them are refused, the others flagged. {} not present on "
      "this machine. "
      "Crashed, hung, not finite, or wrong in silence: {}.\n\nOf all answers, those of every model:",
      counts.cases, counts.to_answer, counts.answered,
      100.0 * counts.answered / std::max(1, counts.to_answer), counts.to_answer - counts.answered,
      counts.without_answer, counts.refused, counts.not_present, counts.unsound);
  for (const auto& [verdict, number] : counts.of_answers)
    text += fmt::format(" {} {},", number, words_for(verdict));
  text.back() = '.';
  text += "\n\nWhat the system cannot do, of these:\n\n";
  for (const std::string& line : counts.cannot) text += line + "\n";
  return text;
}

bool is_asked_for(const Case& one, const std::vector<std::string>& words) {
  const std::string name = one.group + "_" + one.name;
  return words.empty() || std::any_of(words.begin(), words.end(), [&](const std::string& word) {
           return name.find(word) != std::string::npos;
         });
}

int run(const std::filesystem::path& folder, const std::vector<std::string>& words) {
  std::filesystem::create_directories(folder);
  const std::vector<std::string> header = {
      "case",          "asked of", "what happened",        "displacement error %",
      "force error %", "bar %",    "what the answer says", "verdict"};
  std::vector<std::string> csv_header = header;
  csv_header.insert(csv_header.begin(), "group");
  csv_header.push_back("seconds of the case");
  study::StudyTable all("hard_cases", "", csv_header);
  Counts counts;
  bool is_good = true;
  for (const Group& group : all_groups()) {
    study::StudyTable table(group.name, group.reading, header);
    bool any = false;
    for (const Case& one : group.cases) {
      if (!is_asked_for(one, words)) continue;
      any = true;
      const Outcome outcome = run_apart(one, kPatience);
      count(one, outcome, counts);
      const bool is_right = is_as_expected(one, outcome.verdict);
      is_good = is_good && is_right;
      fmt::print("{}{}_{}: {}, {:.1f} s\n", is_right ? "" : "NOT AS EXPECTED ", one.group, one.name,
                 words_for(outcome.verdict), outcome.seconds);
      bool is_first = true;
      for (const Answer& answer : outcome.answers) {
        std::vector<std::string> row = {cell(one.hard),
                                        cell(answer.by),
                                        cell(answer.happened),
                                        percent(answer.displacement_error),
                                        percent(answer.force_error),
                                        percent(one.bar.displacement),
                                        cell(said(answer)),
                                        words_for(answer.verdict)};
        fmt::print("    {}\n", fmt::join(row.begin() + 1, row.end(), " | "));
        std::vector<std::string> csv = row;
        csv.insert(csv.begin(), group.name);
        csv.push_back(fmt::format("{:.1f}", outcome.seconds));
        all.add(csv);
        if (!is_first) row.front().clear();
        is_first = false;
        table.add(row);
      }
    }
    if (any)
      study::write_text(folder / (group.name + ".md"), "## " + group.title + "\n\n" + table.markdown());
  }
  const std::string summary = summary_of(counts);
  fmt::print("\n{}", summary);
  study::write_text(folder / "summary.md", summary);
  study::write_text(folder / "hard_cases.csv", all.csv());
  return is_good ? 0 : 1;
}

}  // namespace
}  // namespace palpate::hard

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
  if (argc < 2) {
    fmt::print(stderr, "usage: palpate_hard_cases DIR [CASE ...]\n");
    return 1;
  }
  try {
    return palpate::hard::run(argv[1], {argv + 2, argv + argc});
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
