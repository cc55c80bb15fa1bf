#include "offline/report/speed_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "offline/report/plot_style.hpp"

namespace palpate {
namespace {

constexpr double kHapticPeriod = 1000;  // microseconds, of a 1 kHz loop

struct Point {
  const MethodRow* row;
  double time;   // us
  double error;  // percent
};

double time_of(const MethodRow& row, SpeedError quantity) {
  return row.haptic.median + (quantity == SpeedError::field ? row.visual.median : 0);
}

double error_of(const MethodRow& row, SpeedError quantity) {
  return 100 * (quantity == SpeedError::field ? row.displacement.p95 : row.force.p95);
}

std::map<double, std::vector<Point>> points_by_part(const OrganReport& organ, SpeedError quantity,
                                                    int contacts) {
  std::map<double, std::vector<Point>> points;
  for (const MethodRow& row : organ.methods) {
    if (row.contacts == contacts)
      points[row.part].push_back({&row, time_of(row, quantity), error_of(row, quantity)});
  }
  return points;
}

// Lifts small errors, such as 0, to just above the lower border `lowest`.
double drawn_error(double error, double lowest) {
  return std::max(error, 1.5 * lowest);
}

std::string copy_line(const OrganReport& organ) {
  if (!organ.smallest_copy) return "";
  return fmt::format(
      "set arrow from {0:g}, graph 0 to {0:g}, graph 1 nohead lc rgb '#888888' dt 3\n"
      "set label 'memcpy, {1:.0f} KB' at {0:g}, graph 0.02 left rotate by 90 offset 0.7,0 font ',10' tc rgb "
      "'#777777'\n",
      organ.smallest_copy->copy.median, organ.smallest_copy->kilobytes);
}

std::string panel(const OrganReport& organ, const std::vector<Point>& points, double part, double lowest,
                  double last_to_right) {
  std::string script;
  std::map<MethodKind, std::vector<std::string>> markers;
  std::vector<std::string> labels;       // to the right of their points
  std::vector<std::string> to_left;      // to the left of points near the right end of the panel
  std::vector<std::string> below_front;  // below the front, where no point lies
  std::vector<std::array<double, 2>> places;
  for (const Point& point : points) {
    places.push_back({point.time, drawn_error(point.error, lowest)});
    const std::string place = fmt::format("{:g} {:g}", point.time, places.back()[1]);
    markers[point.row->kind].push_back(place);
    std::vector<std::string>& side_labels = point.time > last_to_right                  ? to_left
                                            : point.row->kind == MethodKind::polynomial ? below_front
                                                                                        : labels;
    side_labels.push_back(place + " \"" + short_name(point.row->kind, point.row->name) + "\"");
  }
  std::vector<std::string> front;
  const std::vector<size_t> best = pareto_front(places);
  for (size_t i = 0; i < best.size(); ++i) {
    if (i > 0) front.push_back(fmt::format("{:g} {:g}", places[best[i]][0], places[best[i - 1]][1]));
    front.push_back(fmt::format("{:g} {:g}", places[best[i]][0], places[best[i]][1]));
  }
  script += data_block("Front", front) + data_block("Labels", labels) + data_block("ToLeft", to_left) +
            data_block("Below", below_front);
  std::string plots = "$Front using 1:2 with lines lw 5 lc rgb '#d0d0d0'";
  int number = 0;
  for (const auto& [kind, lines] : markers) {
    const MethodStyle& style = style_of(kind);
    const std::string name = fmt::format("Points{}", number++);
    script += data_block(name, lines);
    plots +=
        fmt::format(", ${} using 1:2 with points pt {} ps 1.1 lc rgb '{}'", name, style.marker, style.colour);
  }
  for (const auto& [name, lines, where] : {std::tuple("Labels", &labels, "left offset 0.8,0.5"),
                                           std::tuple("ToLeft", &to_left, "right offset -0.9,0.55"),
                                           std::tuple("Below", &below_front, "right offset -0.6,-0.7")}) {
    if (!lines->empty())
      plots += fmt::format(", ${} using 1:2:3 with labels {} font ',11' tc rgb '#222222'", name, where);
  }
  script += fmt::format("set title {} offset 0,-0.6\n", quoted("|d| = " + push_size(organ, part)));
  script += copy_line(organ);
  script += fmt::format(
      "set arrow from {0:g}, graph 0 to {0:g}, graph 1 nohead lc rgb '#d55e00' dt 2\n"
      "set label '1 kHz' at {0:g}, graph 0.97 right offset -0.4,0 font ',11' tc rgb '#d55e00'\n",
      kHapticPeriod);
  return script + "plot " + plots + "\nunset arrow\nunset label\n";
}

std::string legend(const std::map<double, std::vector<Point>>& points) {
  std::set<MethodKind> kinds;
  for (const auto& [part, level_points] : points) {
    for (const Point& point : level_points) kinds.insert(point.row->kind);
  }
  std::string plots;
  for (const MethodKind kind : kinds) {
    const MethodStyle& style = style_of(kind);
    plots += fmt::format("{}NaN with points pt {} ps 1.1 lc rgb '{}' title {}", plots.empty() ? "" : ", ",
                         style.marker, style.colour, quoted(style.name));
  }
  return "unset border\nunset tics\nunset grid\nunset title\nunset xlabel\nunset ylabel\nunset logscale\n"
         "set lmargin at screen 0\nset rmargin at screen 1\nset bmargin at screen 0.9\nset tmargin at screen "
         "1\n"
         "set xrange [0:1]\nset yrange [0:1]\nset key center center horizontal maxcols 4 samplen 1 width "
         "-1 font ',12'\nplot " +
         plots + ", NaN with lines lw 5 lc rgb '#d0d0d0' title 'nothing is both faster and better'\n";
}

}  // namespace

std::vector<size_t> pareto_front(const std::vector<std::array<double, 2>>& points) {
  std::vector<size_t> order(points.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return points[a] < points[b]; });
  std::vector<size_t> front;
  double best = std::numeric_limits<double>::infinity();
  for (const size_t i : order) {
    if (points[i][1] >= best) continue;
    best = points[i][1];
    front.push_back(i);
  }
  return front;
}

std::string speed_error_plot(const OrganReport& organ, SpeedError quantity, int contacts) {
  const auto points = points_by_part(organ, quantity, contacts);
  double least_error = 100;
  double most_error = 1e-3;
  double least_time = kHapticPeriod;
  double most_time = kHapticPeriod;
  for (const auto& [part, level_points] : points) {
    for (const Point& point : level_points) {
      if (point.error > 0) least_error = std::min(least_error, point.error);
      most_error = std::max(most_error, point.error);
      least_time = std::min(least_time, point.time);
      most_time = std::max(most_time, point.time);
    }
  }
  if (organ.smallest_copy) least_time = std::min(least_time, organ.smallest_copy->copy.median);
  const double lowest = decade_below(least_error) / 3;
  std::string script = plot_frame();
  script += percent_axis("y", lowest, decade_above(most_error));
  const double from = decade_below(0.9 * least_time);
  const double to = decade_above(2 * most_time);
  script += fmt::format("set logscale x\nset xrange [{:g}:{:g}]\nset xtics format '%g' 10\n", from, to);
  script += "set multiplot\n";
  size_t i = 0;
  for (const auto& [part, level_points] : points) {
    const double left = i % 2 == 0 ? 0.085 : 0.575;
    const double bottom = i < 2 ? 0.53 : 0.09;
    script += fmt::format(
        "set lmargin at screen {:.2f}\nset rmargin at screen {:.2f}\nset bmargin at screen {:.2f}\n"
        "set tmargin at screen {:.2f}\nset xlabel {}\nset ylabel {} offset 1.8,0\n",
        left, left + 0.395, bottom, bottom + 0.34,
        i < 2 ? "''"
              : quoted(quantity == SpeedError::field ? "haptic + visual frame, µs" : "haptic frame, µs"),
        i % 2 != 0
            ? "''"
            : quoted(quantity == SpeedError::field ? "displacement error, p95, %" : "force error, p95, %"));
    script += panel(organ, level_points, part, lowest, std::pow(from, 0.28) * std::pow(to, 0.72));
    ++i;
  }
  return script + legend(points) + "unset multiplot\n";
}

std::vector<bool> on_front(const OrganReport& organ, SpeedError quantity) {
  std::map<std::pair<int, double>, std::vector<size_t>> rows_by_panel;
  for (size_t i = 0; i < organ.methods.size(); ++i)
    rows_by_panel[{organ.methods[i].contacts, organ.methods[i].part}].push_back(i);
  std::vector<bool> is_on(organ.methods.size());
  for (const auto& [panel_key, rows] : rows_by_panel) {
    std::vector<std::array<double, 2>> places;
    for (const size_t row : rows)
      places.push_back({time_of(organ.methods[row], quantity), error_of(organ.methods[row], quantity)});
    for (const size_t place : pareto_front(places)) is_on[rows[place]] = true;
  }
  return is_on;
}

}  // namespace palpate
