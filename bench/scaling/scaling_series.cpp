#include "bench/scaling/scaling_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "offline/io/finished_file.hpp"
#include "offline/report/gnuplot.hpp"
#include "offline/report/plot_style.hpp"
#include "offline/report/power_law.hpp"

namespace palpate::scaling {
namespace {

// A colour of Okabe and Ito's set, with a marker.
struct Look {
  const char* colour;
  int marker;
};
constexpr Look kLooks[] = {{"#e69f00", 5}, {"#0072b2", 7}, {"#009e73", 9}, {"#cc79a7", 13}, {"#333333", 11}};

// Tics at 1, 2 and 5 times powers of ten.
std::string tics_between(double low, double high) {
  std::string tics;
  for (double decade = decade_below(low); decade <= high; decade *= 10) {
    for (const int step : {1, 2, 5}) {
      if (step * decade >= 0.8 * low && step * decade <= 1.25 * high)
        tics += fmt::format("{}{:g}", tics.empty() ? "" : ", ", step * decade);
    }
  }
  return tics;
}

// A panel for each name: points, and the fitted line over its range.
std::string plot_of(const std::vector<Series>& all) {
  std::vector<std::string> panels;
  for (const Series& series : all) {
    if (std::find(panels.begin(), panels.end(), series.panel) == panels.end()) panels.push_back(series.panel);
  }
  std::string script = plot_frame() + "set logscale xy\nset format xy '%g'\nset multiplot\n";
  int number = 0;
  for (size_t p = 0; p < panels.size(); ++p) {
    const double left = 0.07 + 0.475 * static_cast<double>(p % 2) + 0.02 * static_cast<double>(p % 2);
    const double rows = std::ceil(static_cast<double>(panels.size()) / 2);
    const double height = 1 / rows;
    const double bottom = 1 - height * (static_cast<double>(p / 2) + 1);
    std::string plots;
    std::string blocks;
    std::string axis;
    double low = std::numeric_limits<double>::infinity();
    double high = 0;
    size_t look = 0;
    for (const Series& series : all) {
      if (series.panel != panels[p]) continue;
      std::vector<std::string> lines;
      for (const auto& [x, y] : series.points) {
        lines.push_back(fmt::format("{:g} {:g}", x, y));
        low = std::min(low, x);
        high = std::max(high, x);
      }
      const PowerLaw fit = fit_power_law(series.points);
      const double x_last = series.points.back().first;
      const double x_first = std::sqrt(series.points.front().first * x_last);
      const Look& style = kLooks[look++ % std::size(kLooks)];
      blocks += data_block(fmt::format("Points{}", number), lines) +
                data_block(fmt::format("Fit{}", number),
                           {fmt::format("{:g} {:g}", x_first, fit.factor * std::pow(x_first, fit.exponent)),
                            fmt::format("{:g} {:g}", x_last, fit.factor * std::pow(x_last, fit.exponent))});
      plots += fmt::format(
          "{}$Fit{} using 1:2 with lines lw 4 lc rgb '#d0d0d0', $Points{} using 1:2 with linespoints pt {} "
          "lw 1.5 lc rgb '{}' title {}",
          plots.empty() ? "plot " : ", ", number, number, style.marker, style.colour,
          palpate::quoted(fmt::format("{}, {}: {:.2f}", series.name, series.unit, fit.exponent)));
      axis = series.size;
      ++number;
    }
    script += blocks +
              fmt::format(
                  "set lmargin at screen {:.3f}\nset rmargin at screen {:.3f}\nset bmargin at screen {:.3f}\n"
                  "set tmargin at screen {:.3f}\nset xrange [{:g}:{:g}]\nset xtics ({})\nset xlabel {} "
                  "offset 0,0.4\nset title {} offset "
                  "0,-0.5\nset key at graph 0.01, graph 0.99 left top vertical samplen 1.5 font ',11'\n"
                  "set yrange [*:*]\nset offsets 0, 0, graph 0.6, 0\n",
                  left, left + 0.42, bottom + 0.22 * height, bottom + 0.88 * height, 0.8 * low, 1.25 * high,
                  tics_between(low, high), palpate::quoted(axis), palpate::quoted(panels[p])) +
              plots + "\n";
  }
  return script + "unset multiplot\n";
}

}  // namespace

void write_scaling(const std::vector<Series>& all, const std::string& caption,
                   const std::filesystem::path& folder) {
  std::string table = "what,unit,over,from,to,at the first,at the last,exponent fitted,expected\n";
  std::string points = "what,over,size,value,unit\n";
  for (const Series& series : all) {
    const auto& first = series.points.front();
    const auto& last = series.points.back();
    table += fmt::format("\"{}\",{},\"{}\",{:g},{:g},{:.3g},{:.3g},{:.2f},{:.2g}\n", series.name, series.unit,
                         series.size, first.first, last.first, first.second, last.second,
                         fit_power_law(series.points).exponent, series.expected);
    for (const auto& [x, y] : series.points)
      points += fmt::format("\"{}\",\"{}\",{:g},{:.6g},{}\n", series.name, series.size, x, y, series.unit);
  }
  write_finished_text(folder / "scaling.csv", table);
  write_finished_text(folder / "scaling_points.csv", points);
  write_finished_text(folder / "scaling.txt", caption);
  draw_plot(plot_of(all), 1000, 1000, folder / "scaling");
}

}  // namespace palpate::scaling
