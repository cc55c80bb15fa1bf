// The page of a report: the Pareto front of time and error, and the text in HTML and gnuplot scripts.
#include <gtest/gtest.h>

#include <cmath>

#include "offline/report/csv_tables.hpp"
#include "offline/report/html_text.hpp"
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
