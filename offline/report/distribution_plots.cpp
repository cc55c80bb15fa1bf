#include "offline/report/distribution_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "offline/report/plot_style.hpp"

namespace palpate {
namespace {

struct Model {
  std::string name;
  MethodKind kind;
  int index_in_kind;  // among the models of the same kind, zones by rising rings
  std::vector<const PushRow*> pushes;
};

// Collects the pack's models with their pushes that satisfy `is_shown`.
std::vector<Model> models_of(const OrganReport& organ, const std::function<bool(const PushRow&)>& is_shown) {
  std::vector<Model> models;
  for (const PushRow& push : organ.pushes) {
    if (!is_shown(push)) continue;
    auto model =
        std::find_if(models.begin(), models.end(), [&](const Model& one) { return one.name == push.name; });
    if (model == models.end()) {
      const auto before = std::count_if(models.begin(), models.end(),
                                        [&](const Model& one) { return one.kind == push.kind; });
      models.push_back({push.name, push.kind, static_cast<int>(before), {}});
      model = models.end() - 1;
    }
    model->pushes.push_back(&push);
  }
  return models;
}

bool is_random(const PushRow& push) {
  return push.set == "random";
}

double p95_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const double place = 0.95 * static_cast<double>(values.size() - 1);
  const auto below = static_cast<size_t>(place);
  const size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
}

// Returns a line width in gnuplot's unit. Zones with more rings get thicker lines.
double line_width(const Model& model) {
  return 1.6 + 0.9 * model.index_in_kind;
}

constexpr double kLeastPercent = 1e-5;  // smaller errors are rounding of single-precision fields
double percent(double error) {
  return std::max(100 * error, kLeastPercent);
}

struct Range {
  double from = std::numeric_limits<double>::infinity();
  double to = 0;
  void add(double value) {
    from = std::min(from, value);
    to = std::max(to, value);
  }
  double low() const { return decade_below(from); }
  double high() const { return decade_above(to); }
};

// A displacement panel and a force panel side by side, with common axes and legend.
class Panels {
 public:
  // Adds a data block and returns its name.
  std::string block(const std::vector<std::string>& lines) {
    const std::string name = fmt::format("Data{}", number_++);
    blocks_ += data_block(name, lines);
    return "$" + name;
  }
  void draw(size_t panel, const std::string& plot) {
    plots_[panel] += (plots_[panel].empty() ? "plot " : ", ") + plot;
  }
  // Returns an error in percent, at least kLeastPercent, and extends the axes to the error.
  double shown(double error) {
    range_.add(percent(error));
    return percent(error);
  }
  double low() const { return range_.low(); }
  double high() const { return range_.high(); }

  // Returns the script. `both`: commands before both panels. `right`: commands before the second panel.
  // `top`: top of the panels, below the legend, as a fraction of the picture.
  std::string script(const std::string& both, const std::string& left_title, const std::string& right,
                     const std::string& right_title, double top = 0.76) const {
    return plot_frame() + blocks_ + both +
           fmt::format("set multiplot layout 1,2 margins 0.09,0.985,0.14,{:.2f} spacing 0.09,0.1\n", top) +
           title_of(left_title) + plots_[0] + "\n" + right + title_of(right_title) + plots_[1] +
           "\nunset multiplot\n";
  }

 private:
  static std::string title_of(const std::string& text) {
    return fmt::format("set title '{}' offset 0,-0.5\n", text);
  }
  std::string blocks_;
  std::string plots_[2];
  Range range_;
  int number_ = 0;
};

double PushRow::*const kErrors[] = {&PushRow::displacement_error, &PushRow::force_error};

const std::string kKeyAbove =
    "set key at screen 0.5, screen 0.97 center top horizontal maxcols 5 samplen 2.5 width 1\n";

}  // namespace

std::string cumulative_plot(const OrganReport& organ) {
  Panels panels;
  const auto steps = [&](const Model& model, double PushRow::*error) {
    std::vector<double> errors;
    for (const PushRow* push : model.pushes) errors.push_back(panels.shown(push->*error));
    std::sort(errors.begin(), errors.end());
    std::vector<std::string> lines;
    for (size_t i = 0; i < errors.size(); ++i) {
      lines.push_back(fmt::format("{:g} {:g}", errors[i],
                                  100.0 * static_cast<double>(i + 1) / static_cast<double>(errors.size())));
    }
    return panels.block(lines) + " using 1:2 with steps ";
  };
  for (const Model& model : models_of(organ, is_random)) {
    const MethodStyle& style = style_of(model.kind);
    const std::string line =
        fmt::format("lw {:.1f} lc rgb '{}' dt {}", line_width(model), style.colour, style.dash);
    panels.draw(0, steps(model, &PushRow::displacement_error) + line + " title " +
                       quoted(short_name(model.kind, model.name)));
    panels.draw(1, steps(model, &PushRow::force_error) + line);
    panels.draw(
        1, steps(model, &PushRow::force_error_unfloored) + fmt::format("lw 0.8 lc rgb '{}'", style.colour));
  }
  const std::string both =
      percent_axis("x", panels.low(), panels.high()) +
      "set xlabel 'error, %'\nset yrange [0:100]\nset ytics 0,25,100 format '%g %%'\n"
      "set arrow from graph 0, first 95 to graph 1, first 95 nohead lc rgb '#999999' dt 3\n"
      "set label '95 %' at graph 0.01, first 97.5 font ',11' tc rgb '#777777'\n"
      "set ylabel 'pushes with no larger error' offset 1,0\n" +
      kKeyAbove;
  return panels.script(both, "displacement, of |d|", "unset ylabel\nunset key\n",
                       "force, of itself (thin: light touches not floored)");
}

std::string error_over_push_plot(const OrganReport& organ) {
  constexpr int kQuarters = 4;
  const double reach = organ.max_displacement / organ.mean_edge;
  Panels panels;
  for (const Model& model : models_of(organ, is_random)) {
    const MethodStyle& style = style_of(model.kind);
    for (size_t panel = 0; panel < 2; ++panel) {
      std::vector<std::string> dots;
      std::vector<double> by_quarter[kQuarters];
      for (const PushRow* push : model.pushes) {
        const double error = panels.shown(push->*kErrors[panel]);
        dots.push_back(fmt::format("{:g} {:g}", push->size / organ.mean_edge, error));
        const int quarter =
            std::clamp(static_cast<int>(std::ceil(kQuarters * push->part)) - 1, 0, kQuarters - 1);
        by_quarter[quarter].push_back(error);
      }
      std::vector<std::string> bars;
      for (int quarter = 0; quarter < kQuarters; ++quarter) {
        if (by_quarter[quarter].empty()) continue;
        bars.push_back(fmt::format("{:g} {:g} {:g}", (quarter + 0.5) / kQuarters * reach,
                                   p95_of(by_quarter[quarter]), 0.46 / kQuarters * reach));
      }
      panels.draw(panel, panels.block(dots) + fmt::format(" using 1:2 with points pt {} ps 0.3 lc rgb '{}'",
                                                          style.marker, style.colour));
      panels.draw(panel,
                  panels.block(bars) +
                      fmt::format(" using 1:2:3 with xerrorbars pt {} ps {} lw {:.1f} lc rgb '{}' title {}",
                                  style.marker, 0.8 + 0.2 * model.index_in_kind, line_width(model),
                                  style.colour, quoted(short_name(model.kind, model.name))));
    }
  }
  const std::string both =
      "set bars 0\n" + percent_axis("y", panels.low(), panels.high()) +
      fmt::format("set xrange [0:{:g}]\nset xlabel '|d| / h'\nset ylabel 'error, %' offset 1.5,0\n", reach) +
      kKeyAbove;
  return panels.script(both, "displacement, of |d|", "unset ylabel\nunset key\n", "force, of itself");
}

std::string coverage_plot(const OrganReport& organ) {
  std::optional<double> PushRow::*const estimates[] = {&PushRow::displacement_estimate,
                                                       &PushRow::force_estimate};
  const std::vector<Model> models = models_of(
      organ, [](const PushRow& push) { return is_random(push) && push.displacement_estimate.has_value(); });
  Panels panels;
  for (const Model& model : models) {  // extends the axes to all errors before the diagonal is drawn
    for (const PushRow* push : model.pushes) {
      for (size_t panel = 0; panel < 2; ++panel) {
        panels.shown(push->*kErrors[panel]);
        panels.shown(*(push->*estimates[panel]));
      }
    }
  }
  const double low = panels.low();
  const double high = panels.high();
  for (size_t panel = 0; panel < 2; ++panel)
    panels.draw(panel,
                fmt::format("{:g} <= x && x <= {:g} ? x : NaN with lines lw 1 lc rgb '#333333'", low, high));
  for (const Model& model : models) {
    const MethodStyle& style = style_of(model.kind);
    for (size_t panel = 0; panel < 2; ++panel) {
      std::vector<std::string> dots;
      int covered = 0;
      for (const PushRow* push : model.pushes) {
        const double error = push->*kErrors[panel];
        const double estimate = *(push->*estimates[panel]);
        covered += error <= estimate ? 1 : 0;
        dots.push_back(fmt::format("{:g} {:g}", panels.shown(estimate), panels.shown(error)));
      }
      panels.draw(panel,
                  panels.block(dots) +
                      fmt::format(" using 1:2 with points pt {} ps {:.2f} lc rgb '{}' title {}", style.marker,
                                  0.45 + 0.1 * model.index_in_kind, style.colour,
                                  quoted(fmt::format("{} {:.1f} %", short_name(model.kind, model.name),
                                                     100.0 * covered / static_cast<double>(dots.size())))));
    }
  }
  const std::string both =
      percent_axis("x", low, high) + percent_axis("y", low, high) +
      "set xlabel 'error as the runtime estimates it, %'\nset ylabel 'error as it is, %' offset 1.5,0\n"
      "set key at graph 0.02, graph 0.98 left top vertical samplen 0.5\n";
  return panels.script(both, "displacement: covered below the line", "unset ylabel\n",
                       "force: covered below the line", 0.9);
}

}  // namespace palpate
