#include "offline/report/html_page.hpp"

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "offline/io/finished_file.hpp"
#include "offline/report/html_text.hpp"
#include "offline/report/organ_section.hpp"

namespace palpate {
namespace {

constexpr const char* kStyle = R"css(
body { font: 16px/1.5 system-ui, "Helvetica Neue", Helvetica, Arial, sans-serif; color: #222; margin: 0 auto; max-width: 1040px; padding: 0 20px 60px; }
h1 { margin: 32px 0 8px; } h2 { margin: 48px 0 4px; border-bottom: 2px solid #222; } h3 { margin: 28px 0 6px; }
.verdict { padding: 14px 18px; border-left: 8px solid; border-radius: 4px; font-size: 18px; }
.kept { background: #e5f5ef; border-color: #009e73; } .broken { background: #fde9e0; border-color: #d55e00; }
.note { background: #fff8e0; padding: 6px 12px; border-left: 4px solid #e69f00; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; margin: 8px 0; }
th, td { border-bottom: 1px solid #ddd; padding: 3px 8px; text-align: right; vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; white-space: nowrap; } th { font-weight: 600; }
tr:hover td { background: #f4f8fb; } .wide { overflow-x: auto; }
figure { margin: 28px 0; break-inside: avoid; } figure img { width: 100%; height: auto; }
figcaption { color: #444; font-size: 14px; } .links { white-space: nowrap; } a { color: #0072b2; }
.about { font-size: 13px; color: #444; } .about td { text-align: left; } summary { cursor: pointer; color: #0072b2; margin-top: 12px; }
@media print { body { max-width: none; font-size: 11px; } .links, summary { display: none; } h2 { break-before: page; } }
)css";

std::string verdict(const Report& report) {
  std::string reasons;
  for (const OrganReport& organ : report.organs) reasons += broken_promises(organ);
  if (reasons.empty())
    return "<p class=\"verdict kept\"><b>Kept.</b> Every model of every pack is as good as its pack says, at "
           "pushes that no "
           "builder has seen.</p>\n";
  return "<p class=\"verdict broken\"><b>Not kept.</b> " + html_escaped(reasons) + "</p>\n";
}

// Lists machine, program and method of the measurements.
std::vector<std::pair<std::string, std::string>> about(const Report& report) {
  std::vector<std::pair<std::string, std::string>> rows;
  const auto row = [&](const char* what, const std::string& value) { rows.emplace_back(what, value); };
  row("processor",
      fmt::format("{}, {} core{}", report.processor, report.cores, report.cores == 1 ? "" : "s"));
  row("compiler", report.compiler + ", " + report.flags);
  row("version", report.version + (report.commit.empty() ? "" : ", commit " + report.commit));
  row("date", report.date);
  row("made by", report.command);
  row("seed",
      fmt::format("{}{}", report.seed, report.quick ? "; quick: few pushes, few sites, short timings" : ""));
  row("took", fmt::format("{:.0f} s", report.seconds));
  return rows;
}

std::string about_html(const Report& report) {
  std::string text = "<table class=\"about\">\n";
  for (const auto& [what, value] : about(report))
    text += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", what, html_escaped(value));
  return text + "</table>\n";
}

std::string about_csv(const Report& report) {
  std::string text = "what,value\n";
  for (const auto& [what, value] : about(report)) {
    std::string quoted;
    for (const char c : value) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    text += fmt::format("{},\"{}\"\n", what, quoted);
  }
  return text;
}

}  // namespace

void write_report(const Report& report, const std::filesystem::path& folder) {
  write_finished_text(folder / "about.csv", about_csv(report));
  std::string sections;
  std::string contents;
  for (const OrganReport& organ : report.organs) {
    sections += write_organ_section(organ, folder);
    contents += fmt::format("{}<a href=\"#{}\">{}</a>", contents.empty() ? "" : " · ",
                            html_escaped(organ.name), html_escaped(organ.title));
  }
  write_finished_text(
      folder / "index.html",
      fmt::format(
          "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
          "content=\"width=device-width\">\n<title>Palpate: speed against "
          "error</title>\n<style>{}</style>\n</head>\n"
          "<body>\n<h1>Speed against error</h1>\n{}<p>How fast each way to answer a touch is, how wrong, and "
          "how sure. Wrong means: against full nonlinear finite element solves of the same model, at pushes "
          "that no fit has seen. "
          "{}</p>\n{}{}</body>\n</html>\n",
          kStyle, verdict(report), contents, about_html(report), sections));
}

}  // namespace palpate
