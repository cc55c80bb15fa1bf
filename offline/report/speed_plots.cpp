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

constexpr double kKilohertz = 1000;  // microseconds

struct Point {
  const MethodRow* row;
  double time;   // us
  double error;  // percent
};

double time_of(const MethodRow& row, SpeedError what) {
  return row.haptic.median + (what == SpeedError::field ? row.visual.median : 0);
}

double error_of(const MethodRow& row, SpeedError what) {
  return 100 * (what == SpeedError::field ? row.displacement.p95 : row.force.p95);
}

std::map<double, std::vector<Point>> points_by_part(const OrganReport& organ, SpeedError what, int contacts) {
  std::map<double, std::vector<Point>> points;
  for (const MethodRow& row : organ.methods) {
    if (row.contacts == contacts) points[row.part].push_back({&row, time_of(row, what), error_of(row, what)});
  }
  return points;
}

// Draws an error of 0 just above the lower border.
double drawn(double error, double lowest) {
  return std::max(error, 1.5 * lowest);
}

// Whether a pack could carry this kind under other settings.
bool has_settings(MethodKind kind) {
  return kind == MethodKind::linear || kind == MethodKind::polynomial || kind == MethodKind::zone;
}

std::string copy_line(const OrganReport& organ) {
  if (organ.copies.empty()) return "";
  const auto& copy =
      *std::min_element(organ.copies.begin(), organ.copies.end(),
                        [](const auto& a, const auto& b) { return a.kilobytes < b.kilobytes; });
  return fmt::format(
      "set arrow from {0:g}, graph 0 to {0:g}, graph 1 nohead lc rgb '#888888' dt 3\n"
      "set label 'memcpy, {1:.0f} KB' at {0:g}, graph 0.02 left rotate by 90 offset 0.7,0 font ',10' tc rgb "
      "'#777777'\n",
      copy.copy.median, copy.kilobytes);
}

std::string panel(const OrganReport& organ, const std::vector<Point>& points, double part, double lowest,
                  double first_to_left) {
  std::string script;
  std::map<std::pair<MethodKind, bool>, std::vector<std::string>> markers;
  std::vector<std::string> labels;       // to the right of their points
  std::vector<std::string> to_left;      // to the left, where the panel ends
  std::vector<std::string> below_front;  // on the free side of the front
  std::vector<std::array<double, 2>> places;
  std::set<std::string> software;  // other software, named once for all its settings
  for (const Point& point : points) {
    places.push_back({point.time, drawn(point.error, lowest)});
    const std::string place = fmt::format("{:g} {:g}", point.time, places.back()[1]);
    markers[{point.row->kind, point.row->carried}].push_back(place);
    const bool is_elsewhere = point.row->kind == MethodKind::elsewhere;
    if (!point.row->carried && point.row->kind != MethodKind::newton && !is_elsewhere) continue;
    if (is_elsewhere && !software.insert(short_name(*point.row)).second) continue;
    std::vector<std::string>& of_place = point.time > first_to_left                  ? to_left
                                         : point.row->kind == MethodKind::polynomial ? below_front
                                                                                     : labels;
    of_place.push_back(place + " \"" + short_name(*point.row) + "\"");
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
    const MethodStyle& style = style_of(kind.first);
    const std::string name = fmt::format("Points{}", number++);
    script += data_block(name, lines);
    plots +=
        fmt::format(", ${} using 1:2 with points pt {} ps {} lw 1.4 lc rgb '{}'", name,
                    kind.second ? style.marker : style.hollow_marker, kind.second ? 1.1 : 0.75, style.colour);
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
      kKilohertz);
  return script + "plot " + plots + "\nunset arrow\nunset label\n";
}

std::string legend(const std::map<double, std::vector<Point>>& points) {
  std::map<std::pair<MethodKind, bool>, bool> kinds;
  for (const auto& [part, of_part] : points) {
    for (const Point& point : of_part) kinds[{point.row->kind, point.row->carried}] = true;
  }
  std::string plots;
  for (const auto& [kind, there] : kinds) {
    const MethodStyle& style = style_of(kind.first);
    plots +=
        fmt::format("{}NaN with points pt {} ps 1.1 lw 1.4 lc rgb '{}' title {}", plots.empty() ? "" : ", ",
                    kind.second ? style.marker : style.hollow_marker, style.colour,
                    quoted(std::string(style.name) +
                           (kind.second || !has_settings(kind.first) ? "" : ", other settings")));
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

std::string speed_error_plot(const OrganReport& organ, SpeedError what, int contacts) {
  const auto points = points_by_part(organ, what, contacts);
  double least_error = 100;
  double most_error = 1e-3;
  double least_time = kKilohertz;
  double most_time = kKilohertz;
  for (const auto& [part, of_part] : points) {
    for (const Point& point : of_part) {
      if (point.error > 0) least_error = std::min(least_error, point.error);
      most_error = std::max(most_error, point.error);
      least_time = std::min(least_time, point.time);
      most_time = std::max(most_time, point.time);
    }
  }
  for (const CopyRow& copy : organ.copies) least_time = std::min(least_time, copy.copy.median);
  const double lowest = decade_below(least_error) / 3;
  std::string script = plot_frame();
  script += percent_axis("y", lowest, decade_above(most_error));
  const double from = decade_below(0.9 * least_time);
  const double to = decade_above(2 * most_time);
  script += fmt::format("set logscale x\nset xrange [{:g}:{:g}]\nset xtics format '%g' 10\n", from, to);
  script += "set multiplot\n";
  size_t i = 0;
  for (const auto& [part, of_part] : points) {
    const double left = i % 2 == 0 ? 0.085 : 0.575;
    const double bottom = i < 2 ? 0.53 : 0.09;
    script += fmt::format(
        "set lmargin at screen {:.2f}\nset rmargin at screen {:.2f}\nset bmargin at screen {:.2f}\n"
        "set tmargin at screen {:.2f}\nset xlabel {}\nset ylabel {} offset 1.8,0\n",
        left, left + 0.395, bottom, bottom + 0.34,
        i < 2 ? "''" : quoted(what == SpeedError::field ? "haptic + visual frame, µs" : "haptic frame, µs"),
        i % 2 != 0
            ? "''"
            : quoted(what == SpeedError::field ? "displacement error, p95, %" : "force error, p95, %"));
    script += panel(organ, of_part, part, lowest, std::pow(from, 0.28) * std::pow(to, 0.72));
    ++i;
  }
  return script + legend(points) + "unset multiplot\n";
}

std::vector<bool> on_front(const OrganReport& organ, SpeedError what) {
  std::map<std::pair<int, double>, std::vector<size_t>> alike;
  for (size_t i = 0; i < organ.methods.size(); ++i)
    alike[{organ.methods[i].contacts, organ.methods[i].part}].push_back(i);
  std::vector<bool> is_on(organ.methods.size());
  for (const auto& [of_what, rows] : alike) {
    std::vector<std::array<double, 2>> places;
    for (const size_t row : rows)
      places.push_back({time_of(organ.methods[row], what), error_of(organ.methods[row], what)});
    for (const size_t place : pareto_front(places)) is_on[rows[place]] = true;
  }
  return is_on;
}

int frame_plot_height(const OrganReport& organ) {
  const auto rows = std::count_if(organ.methods.begin(), organ.methods.end(),
                                  [](const MethodRow& row) { return row.carried && row.part == 1; });
  return 150 + 42 * static_cast<int>(rows);
}

std::string frame_plot(const OrganReport& organ) {
  std::vector<std::string> lines;
  std::string names;
  std::vector<std::string> cold;
  std::vector<std::string> copies;
  double least = kKilohertz;
  double most = kKilohertz;
  const auto add = [&](const MethodRow& row, const char* stage, const TimeSummary& time,
                       const std::optional<TimeSummary>& when_cold) {
    const auto at = -static_cast<double>(lines.size());
    lines.push_back(fmt::format("{:g} {:g} {:g} {:g} {}", at, time.median, time.p999, time.max,
                                style_of(row.kind).colour));
    if (when_cold) cold.push_back(fmt::format("{:g} {:g}", at, when_cold->median));
    const std::string contacts = row.contacts > 1 ? fmt::format(" x {}", row.contacts) : "";
    names += fmt::format("{}{} {:g}", names.empty() ? "" : ", ",
                         quoted(short_name(row) + contacts + ", " + stage), at);
    least = std::min(least, time.median);
    most = std::max(most, time.max);
    for (const CopyRow& copy : organ.copies) {
      if (stage == std::string("visual") && copy.method == row.name && row.contacts == 1)
        copies.push_back(fmt::format("{:g} {:g}", at, copy.copy.median));
    }
  };
  for (const MethodRow& row : organ.methods) {
    if (!row.carried || row.part != 1) continue;
    add(row, "haptic", row.haptic, row.haptic_cold);
    add(row, "visual", row.visual, row.visual_cold);
  }
  std::string script = plot_frame();
  script += data_block("Frames", lines) + data_block("Cold", cold) + data_block("Copies", copies);
  script += fmt::format(
      "set logscale x\nset xrange [{:g}:{:g}]\nset xtics format '%g' 10\nset yrange [{:g}:0.8]\nset ytics "
      "({})\n"
      "set xlabel 'one frame, µs'\nset key at screen 0.5, screen 0.99 center top horizontal maxcols 5 "
      "samplen 2\nset tmargin 3.5\nset lmargin 24\n"
      "set arrow from 1000, graph 0 to 1000, graph 1 nohead lc rgb '#d55e00' dt 2\n"
      "set label '1 kHz' at 1000, graph 1 right offset -0.4,-0.6 font ',11' tc rgb '#d55e00'\n",
      decade_below(0.9 * least), decade_above(most), -static_cast<double>(lines.size()) + 0.2, names);
  const std::string rgb = "(rgb(strcol(5)))";
  script += "rgb(s) = int('0x'.s[2:7])\n";
  script += fmt::format(
      "plot $Frames using 2:1:($4-$2):(0):{0} with vectors nohead lw 1 lc rgb variable title 'to the "
      "maximum', "
      "'' using 2:1:($3-$2):(0):{0} with vectors nohead lw 6 lc rgb variable title 'to p99.9', "
      "'' using 2:1:{0} with points pt 7 ps 1 lc rgb variable title 'median, warm', "
      "$Cold using 2:1 with points pt 6 ps 1 lw 1.5 lc rgb '#333333' title 'median, caches cold', "
      "$Copies using 2:1 with points pt 2 ps 1 lw 1.5 lc rgb '#333333' title 'memcpy of what the field "
      "reads'\n",
      rgb);
  return script;
}

}  // namespace palpate
