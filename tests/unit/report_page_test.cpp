// The page of a report: the Pareto front of time and error, and the text in HTML and gnuplot scripts.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "offline/report/csv_tables.hpp"
#include "offline/report/html_text.hpp"
#include "offline/report/methods_elsewhere.hpp"
#include "offline/report/organ_section.hpp"
#include "offline/report/plot_style.hpp"
#include "offline/report/power_law.hpp"
#include "offline/report/speed_plots.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {
namespace report_page_test {

TEST(ReportPage, TheFrontIsUnbeatenInTimeAndError) {
  // (time, error). The second point is slower and worse than the first. The last is as slow as the third and
  // worse.
  const std::vector<std::array<double, 2>> points = {{1, 5}, {2, 6}, {3, 1}, {0.5, 9}, {3, 2}};
  EXPECT_EQ(pareto_front(points), (std::vector<size_t>{3, 0, 2}));
  EXPECT_TRUE(pareto_front({}).empty());
}

TEST(ReportPage, TextIsEscaped) {
  EXPECT_EQ(html_escaped("a<b> & \"c\""), "a&lt;b&gt; &amp; &quot;c&quot;");
  EXPECT_EQ(quoted("it's _a_ {b}"), "'it''s \\_a\\_ \\{b\\}'");
}

TEST(ReportPage, TheFrontIsOfAsManyContactsAndAsFarAPush) {
  OrganReport organ;
  const auto add = [&](int contacts, double part, double time, double error) {
    MethodRow& row = organ.methods.emplace_back();
    row.contacts = contacts;
    row.part = part;
    row.haptic.median = time;
    row.visual.median = 1;
    row.displacement.p95 = error;
    row.force.p95 = 1 / error;
  };
  add(1, 1, 2, 0.1);
  add(1, 1, 3, 0.2);    // worse field than the first, better force
  add(1, 0.5, 9, 0.9);  // the only method at its |d|
  add(3, 1, 9, 0.9);    // the only method with its contacts
  EXPECT_EQ(on_front(organ, SpeedError::field), (std::vector<bool>{true, false, true, true}));
  EXPECT_EQ(on_front(organ, SpeedError::force), (std::vector<bool>{true, true, true, true}));
}

TEST(ReportPage, AnExponentIsThatOfTheLargeSizes) {
  std::vector<std::pair<double, double>> points;
  for (double x = 1; x <= 4096; x *= 2) points.emplace_back(x, 3 * std::pow(x, 1.7));
  constexpr double kRounding = 1e-12;
  EXPECT_NEAR(fit_power_law(points).exponent, 1.7, kRounding);
  EXPECT_NEAR(fit_power_law(points).factor, 3, 1e3 * kRounding);
  for (auto& [x, y] : points) {
    if (x < 64) y = 1e6;  // constant at small sizes
  }
  EXPECT_NEAR(fit_power_law(points).exponent, 1.7, kRounding);
  EXPECT_NEAR(fit_power_law({{1, 7}, {2, 3}, {1000, 5}, {2000, 10}}).exponent, 1, kRounding);
}

TEST(ReportPage, ATableOfOthersIsReadCellByCell) {
  const TempDir dir;
  const std::filesystem::path file = dir.write("t.csv", "a,\"b, c\"\r\n\"1 \"\"x\"\"\",\n\n2,3");
  const IncludedTable table = read_included_table("T", file);
  EXPECT_EQ(table.rows, (std::vector<std::vector<std::string>>{{"a", "b, c"}, {"1 \"x\"", ""}, {"2", "3"}}));
  EXPECT_EQ(table.name, "t");
  EXPECT_EQ(table.caption, "");
  const auto refusal = [&](const std::string& text) {
    try {
      read_included_table("T", dir.write("bad.csv", text));
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).substr((dir.path() / "bad.csv").string().size());
    }
    return std::string("none");
  };
  EXPECT_EQ(refusal(""), ": no table; its first line must have the headings");
  EXPECT_EQ(refusal("a,b\n\"1,2\n"), ":2: a quote is not closed; end it on its line");
  EXPECT_EQ(refusal("a,b\n1,2,3\n"), ":2: 3 cells, where the first line has 2 headings");
  EXPECT_THROW(read_included_table("T", dir.path() / "none.csv"), std::runtime_error);
}

// Methods of other software, with all columns of a report's CSV or only the required columns.
TEST(ReportPage, MethodsOfOthersStandBesideOurOwn) {
  const TempDir dir;
  OrganReport written;
  written.mean_edge = written.max_displacement = 1;
  MethodRow& method = written.methods.emplace_back();
  method.name = "other, fast";
  method.contacts = 2;
  method.part = 0.05 / 0.3;
  method.pushes = 7;
  method.diverged = 1;
  method.displacement = {0.1, 0.2, 0.25};
  method.force = {0.3, 0.4, 0.5};
  method.force_unfloored = {0.6, 0.7, 0.8};
  method.displacement_off = {1, 2, 3};
  method.force_off = {4, 5, 6};
  method.haptic = {1000, 1100, 1200, 1300, 900, 1050};
  method.visual_cold = {10, 11, 12, 13, 9, 10.5};
  const std::filesystem::path file = dir.write("others.csv", methods_csv(written));
  dir.write("others.txt", "By <hand>.");
  const MethodsElsewhere elsewhere = read_methods_elsewhere(file);
  ASSERT_EQ(elsewhere.rows.size(), 1u);
  EXPECT_EQ(elsewhere.rows[0].name, method.name);
  EXPECT_EQ(elsewhere.rows[0].kind, MethodKind::elsewhere);
  EXPECT_EQ(elsewhere.rows[0].diverged, 1);

  OrganReport organ;
  organ.mean_edge = organ.max_displacement = 1;
  organ.methods.emplace_back().contacts = 2;
  organ.methods.back().part = method.part;
  add_methods_elsewhere(elsewhere, organ);
  ASSERT_EQ(organ.methods.size(), 2u);
  EXPECT_TRUE(organ.notes.empty());
  EXPECT_EQ(organ.methods[1].part, method.part);  // full precision, not the CSV's rounding
  const auto last_line = [](const OrganReport& report) {
    const std::string text = methods_csv(report);
    const std::string on_fronts = ",1,1\n";
    const size_t from = text.rfind('\n', text.size() - 2);
    return text.substr(from, text.size() - on_fronts.size() - from);
  };
  EXPECT_EQ(last_line(organ), last_line(written));
  EXPECT_EQ(organ.captions_elsewhere, std::vector<std::string>{"By <hand>."});

  organ.methods[0].contacts = 1;  // no method to compare with
  organ.methods.resize(1);
  add_methods_elsewhere(elsewhere, organ);
  EXPECT_EQ(organ.methods.size(), 1u);
  ASSERT_EQ(organ.notes.size(), 1u);
  EXPECT_NE(organ.notes[0].find("with 2 contacts at 0.166667 of the largest |d| is left out"),
            std::string::npos)
      << organ.notes[0];
}

TEST(ReportPage, MethodsOfOthersAreRefusedWithTheirPlace) {
  const TempDir dir;
  const std::string least =
      "method,contacts,part_of_max,displacement_p95,displacement_max,force_p95,force_max,haptic_median_us,"
      "haptic_p999_us,haptic_max_us\n";
  const auto refusal = [&](const std::string& text) -> std::string {
    try {
      read_methods_elsewhere(dir.write("bad.csv", text));
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).substr((dir.path() / "bad.csv").string().size());
    }
    return "none";
  };
  EXPECT_EQ(refusal(least + "x,1,0.5,0.1,0.2,0.1,0.2,10,20,30\n"), "none");
  EXPECT_EQ(refusal(least), ": no method; give it a line for each");
  EXPECT_EQ(refusal(least + "x,1,0.5,nan,0.2,0.1,0.2,10,20,30\n"),
            ":2: displacement_p95 is \"nan\"; it must be a number, not below 0");
  EXPECT_EQ(refusal(least + "\nx,1,0.5,0.1,0.2,0.1,0.2,10,-1,30\n"),
            ":3: haptic_p999_us is \"-1\"; it must be a number, not below 0");
  EXPECT_EQ(refusal(least + "x,1.5,0.5,0.1,0.2,0.1,0.2,10,20,30\n"),
            ":2: contacts is \"1.5\"; it must be a whole number from 1 on");
  EXPECT_EQ(refusal(least + "x,1,,0.1,0.2,0.1,0.2,10,20,30\n"), ":2: part_of_max is empty; give it");
  EXPECT_EQ(
      refusal("method,contacts\nx,1\n"),
      ": no column part_of_max; its columns are to be those of the ORGAN_methods.csv that a report writes");
}

// RFC 4648, section 10.
TEST(ReportPage, FilesAreEncodedAsBase64) {
  const TempDir dir;
  for (const auto& [text, code] : {std::pair("", ""), std::pair("f", "Zg=="), std::pair("fo", "Zm8="),
                                   std::pair("foo", "Zm9v"), std::pair("foobar", "Zm9vYmFy")})
    EXPECT_EQ(data_uri(dir.write("file", text), "a/b"), std::string("data:a/b;base64,") + code);
}

TEST(ReportPage, ABrokenPromiseIsNamedWithItsNumbers) {
  OrganReport organ;
  organ.title = "liver";
  organ.promises = {{"linear_dd", 10, 0.1, 0.1, 0.1, 0.1, 1, 1, true}};
  EXPECT_EQ(broken_promises(organ), "");
  organ.promises.push_back({"polynomial_dd", 10, 0.01, 0.032, 0.02, 0.021, 0.5, 0.9, false});
  const std::string reason = broken_promises(organ);
  EXPECT_EQ(reason.find("linear_dd"), std::string::npos);
  for (const char* part : {"liver, polynomial_dd", "3.2 %", "2.1 %", "says 1 and 2", "50.0 and 90.0 %"})
    EXPECT_NE(reason.find(part), std::string::npos) << part << ": " << reason;
}

TEST(ReportPage, CsvHasACellForEachHeading) {
  OrganReport organ;
  organ.mean_edge = organ.max_displacement = 1;
  organ.thickness = 2;
  organ.pushes.emplace_back().displacements = {{1, 2, 3}, {4, 5, 6.5}};
  organ.methods.emplace_back();
  EXPECT_NE(pushes_csv(organ).find(",1;4,2;5,3;6.5,"), std::string::npos) << pushes_csv(organ);
  const auto commas = [](const std::string& text, bool in_quotes) {
    size_t count = 0;
    bool quote = false;
    for (const char c : text) {
      quote = quote != (c == '"');
      count += c == ',' && quote == in_quotes;
    }
    return count;
  };
  for (const std::string& csv : {pushes_csv(organ), methods_csv(organ)}) {
    const size_t end = csv.find('\n');
    EXPECT_EQ(commas(csv.substr(0, end), false), commas(csv.substr(end), false)) << csv;
    EXPECT_GT(commas(csv, false), 20u);
  }
}

}  // namespace report_page_test
}  // namespace palpate::test
