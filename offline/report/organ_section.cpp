#include "offline/report/organ_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "offline/io/finished_file.hpp"
#include "offline/report/csv_tables.hpp"
#include "offline/report/distribution_plots.hpp"
#include "offline/report/gnuplot.hpp"
#include "offline/report/html_text.hpp"
#include "offline/report/plot_style.hpp"
#include "offline/report/speed_plots.hpp"

namespace palpate {
namespace {

std::string percent_cell(double part) {
  return fmt::format("{:.3g}", 100 * part);
}

std::string us_cell(double microseconds) {
  return microseconds == 0 ? "" : fmt::format("{:.3g}", microseconds);
}

// A table that prints as HTML and as Markdown.
class Table {
 public:
  explicit Table(std::vector<std::string> headings) : rows_{std::move(headings)} {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  std::string html() const { return html_table(rows_); }
  std::string markdown() const {
    std::string text;
    for (size_t i = 0; i < rows_.size(); ++i) {
      for (const std::string& cell : rows_[i]) {
        text += "| ";
        for (const char c : cell) text += c == '|' ? std::string("\\|") : std::string(1, c);
        text += ' ';
      }
      text += "|\n";
      if (i > 0) continue;
      text += "|---";
      for (size_t k = 1; k < rows_[i].size(); ++k) text += "|--:";
      text += "|\n";
    }
    return text;
  }

 private:
  std::vector<std::vector<std::string>> rows_;
};

Table validation_table(const OrganReport& organ) {
  Table table({"model", "pushes", "displacement error, p95 %", "the pack says", "within the estimate, %",
               "force error, p95 %", "the pack says", "within the estimate, %", ""});
  for (const ValidationRow& row : organ.promises) {
    table.add({row.model, fmt::format("{}", row.pushes), percent_cell(row.found_displacement_p95),
               percent_cell(row.claimed_displacement_p95),
               fmt::format("{:.1f}", 100 * row.displacement_coverage), percent_cell(row.found_force_p95),
               percent_cell(row.claimed_force_p95), fmt::format("{:.1f}", 100 * row.force_coverage),
               row.kept ? "kept" : "NOT KEPT"});
  }
  return table;
}

// Millimetres and millinewtons where the scene states its units, else the model's units.
struct TableUnits {
  double per_length = 1;  // table units per length unit of the model
  double per_force = 1;
  std::string length = "length unit";
  std::string force = "force unit";
  explicit TableUnits(const OrganReport& organ) {
    if (organ.length_unit.empty()) return;
    per_length = 1e3 * organ.metres_per_length_unit;
    per_force = 1e3 * organ.newtons_per_force_unit;
    length = "mm";
    force = "mN";
  }
};

double level_near_half(const OrganReport& organ) {
  double near = 1;
  for (const MethodRow& row : organ.methods) {
    if (std::abs(row.part - 0.5) < std::abs(near - 0.5)) near = row.part;
  }
  return near;
}

// Lists all compared |d| with `every_size`, else the |d| near half and at full range.
Table method_table(const OrganReport& organ, bool every_size) {
  const TableUnits units(organ);
  Table table({"method", "contacts", "|d|", "displacement error, p95 %", "max %", "max, " + units.length,
               "force error, p95 %", "max %", "unfloored, max %", "max, " + units.force, "haptic frame, µs",
               "p99.9", "cold", "visual frame, µs", "p99.9", "cold"});
  const double half = level_near_half(organ);
  for (const MethodRow& row : organ.methods) {
    if (!every_size && row.part != half && row.part != 1) continue;
    const auto cold = [](const std::optional<TimeSummary>& time) {
      return time ? us_cell(time->median) : std::string();
    };
    const bool exact = row.kind == MethodKind::newton;
    const auto error = [&](double value) { return exact ? std::string("0") : percent_cell(value); };
    table.add({row.name, fmt::format("{}", row.contacts), push_size(organ, row.part),
               error(row.displacement.p95), error(row.displacement.max),
               fmt::format("{:.3g}", units.per_length * row.displacement_off.max), error(row.force.p95),
               error(row.force.max), error(row.force_unfloored.max),
               fmt::format("{:.3g}", units.per_force * row.force_off.max), us_cell(row.haptic.median),
               us_cell(row.haptic.p999), cold(row.haptic_cold), us_cell(row.visual.median),
               us_cell(row.visual.p999), cold(row.visual_cold)});
  }
  return table;
}

// Returns the largest ratio between the medians of two rounds: the change to expect in a second run.
double time_spread(const OrganReport& organ) {
  double spread = 1;
  for (const MethodRow& row : organ.methods) {
    if (row.haptic.lowest > 0) spread = std::max(spread, row.haptic.highest / row.haptic.lowest);
  }
  return spread;
}

std::string facts(const OrganReport& organ) {
  return fmt::format(
      "{}: {} nodes, {} elements, mean surface edge h = {:.4g}{}{}; a pack of {:.1f} MB with {} site{}, {} "
      "shown nodes, "
      "pushes to {}, up to {} contact{}.",
      organ.source, organ.nodes, organ.elements, organ.mean_edge, organ.length_unit.empty() ? "" : " ",
      organ.length_unit, organ.pack_megabytes, organ.sites, organ.sites == 1 ? "" : "s", organ.shown_nodes,
      push_size(organ, 1), organ.max_contacts, organ.max_contacts == 1 ? "" : "s");
}

class Section {
 public:
  Section(const OrganReport& organ, const std::filesystem::path& folder) : organ_(organ), folder_(folder) {}

  void text(const std::string& html) { html_ += html; }

  void figure(const std::string& name, const std::string& script, int width, int height,
              const std::string& csv, const std::string& heading, const std::string& caption) {
    const std::filesystem::path file = folder_ / "plots" / (organ_.name + "_" + name);
    draw_plot(script, width, height, file);
    std::filesystem::path svg = file;
    svg += ".svg";
    add(heading, data_uri(svg, "image/svg+xml"), caption,
        fmt::format("<a href=\"{0}\">numbers</a>, <a href=\"plots/{1}_{2}.svg\">plot</a>, <a "
                    "href=\"plots/{1}_{2}.gp\">script</a>",
                    html_escaped(csv), html_escaped(organ_.name), name));
  }

  void add(const std::string& heading, const std::string& uri, const std::string& caption,
           const std::string& links) {
    html_ += fmt::format(
        "<figure>\n<h3>{0}</h3>\n<img alt=\"{0}\" src=\"{1}\">\n<figcaption>{2} <span "
        "class=\"links\">{3}</span></figcaption>\n</figure>\n",
        heading, uri, caption, links);
  }
  std::string take() { return std::move(html_); }

 private:
  const OrganReport& organ_;
  std::filesystem::path folder_;
  std::string html_;
};

void add_validation(const OrganReport& organ, Section& section) {
  section.text(
      "<h3>Does the pack keep what it says?</h3>\n<p>Random pushes at random sites that its builder has not "
      "seen, solved in full from rest. Errors of 95 of 100 pushes stay below p95.</p>\n" +
      validation_table(organ).html());
  if (organ.unsolved > 0)
    section.text(
        fmt::format("<p class=\"note\">{} pushes reached no equilibrium and count as errors of 100 %.</p>\n",
                    organ.unsolved));
}

// Adds plots of time against error. `csv`: file with the numbers.
void add_speed_figures(const OrganReport& organ, const std::string& csv, Section& section) {
  section.figure(
      "speed_error", speed_error_plot(organ, SpeedError::field, 1), 1000, 860, csv, "Speed against error",
      fmt::format(
          "Each point is a method: further left is faster, further down is nearer to the full nonlinear "
          "solve. Models of the pack answer when the contact has come to rest; full Newton starts from the "
          "state of the frame before, and is the truth: its error is nothing, drawn on the lower border. The "
          "grey staircase joins the methods that nothing beats in both. Right of the dashed line a 1 kHz "
          "loop is missed; the dotted line is a memcpy of the bytes that the smallest model's field reads. "
          "One contact at {} sites; error: the largest of any shown node, as part of |d|, p95 over the "
          "pushes; time: median of a haptic and a visual frame together, warm.",
          organ.sites_compared));
  section.figure("speed_force", speed_error_plot(organ, SpeedError::force, 1), 1000, 860, csv,
                 "Speed against error of the force",
                 "The same for what a haptic device needs: one haptic frame (force and stiffness), and the "
                 "error of the force as part of it. Forces below 5 % of the largest are divided by that, "
                 "lest light touches count by their smallness.");
  const bool several = std::any_of(organ.methods.begin(), organ.methods.end(),
                                   [](const MethodRow& row) { return row.contacts > 1; });
  if (several) {
    const int contacts =
        std::max_element(organ.methods.begin(), organ.methods.end(), [](const auto& a, const auto& b) {
          return a.contacts < b.contacts;
        })->contacts;
    section.figure("several", speed_error_plot(organ, SpeedError::field, contacts), 1000, 860, csv,
                   fmt::format("{} contacts at a time", contacts),
                   "As above, with the contacts at random sites anywhere on the organ, each pushed its own "
                   "way. Polynomials answer one contact alone and are not here.");
  }
}

// Adds plots of the errors of random pushes. `csv`: file with the numbers.
void add_error_figures(const OrganReport& organ, const std::string& csv, Section& section) {
  section.figure(
      "cumulative", cumulative_plot(organ), 1000, 460, csv, "How errors are distributed",
      "How many of the random pushes, in percent, are answered with no larger error: further left "
      "is better, and a steep line means that all pushes are alike. Where a line crosses 95 % is the p95.");
  section.figure("over_push", error_over_push_plot(organ), 1000, 460, csv, "How errors grow with the push",
                 "Each dot is a random push; bars are the p95 of each quarter of the range. One h is the "
                 "organ's mean surface edge: errors follow |d| / h, since elements next to the tip bear it.");
  section.figure("coverage", coverage_plot(organ), 1000, 500, csv, "Does the runtime know how wrong it is?",
                 "With each answer the runtime gives an estimate that 95 of 100 errors should stay below. "
                 "Each mark is a random push; below the line the estimate covered it. The legend says how "
                 "many were covered.");
  if (!organ.error_map.empty()) {
    section.add("Where it is wrong", data_uri(organ.error_map, "image/png"),
                "The largest error of each shown node over all random pushes, as part of |d|: the worst and "
                "the best of the pack's models, each with its own scale.",
                fmt::format("<a href=\"{}\">picture</a>", html_escaped(organ.error_map.filename().string())));
  }
}

void add_method_tables(const OrganReport& organ, Section& section) {
  section.text(
      fmt::format("<h3>In numbers</h3>\n<p>Frames of contacts that go around at |d|. Cold: all caches were "
                  "emptied before the frame. Medians of a second run on this machine may differ as medians "
                  "of its rounds did, by a factor of up to {:.2f}. Errors of a second run are the same to "
                  "the digit.</p>\n",
                  time_spread(organ)));
  section.text("<div class=\"wide\">" + method_table(organ, false).html() + "</div>\n");
  section.text("<details><summary>Every |d|</summary>\n<div class=\"wide\">" +
               method_table(organ, true).html() + "</div></details>\n");
}

}  // namespace

std::string broken_promises(const OrganReport& organ) {
  std::string reasons;
  for (const ValidationRow& row : organ.promises) {
    if (row.kept) continue;
    reasons += fmt::format(
        "{}{}, {}: over {} pushes the p95 is {} % of |d| in displacement and {} % in force, where the pack "
        "says {} and {}; "
        "{:.1f} and {:.1f} % of the errors are within the runtime's estimates.",
        reasons.empty() ? "" : " ", organ.title, row.model, row.pushes,
        percent_cell(row.found_displacement_p95), percent_cell(row.found_force_p95),
        percent_cell(row.claimed_displacement_p95), percent_cell(row.claimed_force_p95),
        100 * row.displacement_coverage, 100 * row.force_coverage);
  }
  return reasons;
}

std::string organ_markdown(const OrganReport& organ) {
  return facts(organ) + "\n\n" + validation_table(organ).markdown() + "\n" +
         method_table(organ, false).markdown();
}

std::string write_organ_section(const OrganReport& organ, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "plots");
  const std::string pushes = organ.name + "_pushes.csv";
  const std::string methods = organ.name + "_methods.csv";
  write_finished_text(folder / pushes, pushes_csv(organ));
  write_finished_text(folder / methods, methods_csv(organ));
  write_finished_text(folder / (organ.name + ".md"), organ_markdown(organ));

  Section section(organ, folder);
  section.text(fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n<p>{}</p>\n", html_escaped(organ.name),
                           html_escaped(organ.title), html_escaped(facts(organ))));
  for (const std::string& note : organ.notes)
    section.text("<p class=\"note\">" + html_escaped(note) + "</p>\n");
  add_validation(organ, section);
  add_speed_figures(organ, methods, section);
  add_error_figures(organ, pushes, section);
  add_method_tables(organ, section);
  section.text("</section>\n");
  return section.take();
}

}  // namespace palpate
