#include "offline/report/distribution_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "offline/report/plot_style.hpp"

namespace palpate {
namespace {

struct Model {
  std::string name;
  MethodKind kind;
  int of_kind;  // how many of its kind came before it
  std::vector<const PushRow*> pushes;
};

// The pack's own, with those of their pushes that count.
std::vector<Model> models_of(const OrganReport& organ, const std::function<bool(const PushRow&)>& counts) {
  std::vector<Model> models;
  for (const PushRow& push : organ.pushes) {
    if (!push.carried || !counts(push)) continue;
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

// More rings of a zone: thicker lines, larger points.
double weight(const Model& model) {
  return 1.6 + 0.9 * model.of_kind;
}

// Percent; below it nothing is told from rounding of fields in single precision.
constexpr double kLeastPercent = 1e-5;
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

// `top`: of the panels, as part of the picture; above it a legend has its place.
std::string two_panels(const std::string& both, const std::string& left, const std::string& right,
                       double top = 0.76) {
  return plot_frame() + both +
         fmt::format("set multiplot layout 1,2 margins 0.09,0.985,0.14,{:.2f} spacing 0.09,0.1\n", top) +
         left + right + "unset multiplot\n";
}

std::string title_of(const char* what) {
  return fmt::format("set title '{}' offset 0,-0.5\n", what);
}

const std::string kKeyAbove =
    "set key at screen 0.5, screen 0.97 center top horizontal maxcols 5 samplen 2.5 width 1\n";

}  // namespace

std::string cumulative_plot(const OrganReport& organ) {
  const std::vector<Model> models = models_of(organ, is_random);
  std::string blocks;
  std::string fields;
  std::string forces;
  Range range;
  int number = 0;
  const auto steps = [&](const Model& model, double PushRow::*error) {
    std::vector<double> errors;
    for (const PushRow* push : model.pushes) errors.push_back(percent(push->*error));
    std::sort(errors.begin(), errors.end());
    std::vector<std::string> lines;
    for (size_t i = 0; i < errors.size(); ++i) {
      range.add(errors[i]);
      lines.push_back(fmt::format("{:g} {:g}", errors[i],
                                  100.0 * static_cast<double>(i + 1) / static_cast<double>(errors.size())));
    }
    const std::string name = fmt::format("Steps{}", number++);
    blocks += data_block(name, lines);
    return name;
  };
  for (const Model& model : models) {
    const MethodStyle& style = style_of(model.kind);
    const std::string line =
        fmt::format("lw {:.1f} lc rgb '{}' dt {}", weight(model), style.colour, style.dash);
    fields += fmt::format("{}${} using 1:2 with steps {} title {}", fields.empty() ? "plot " : ", ",
                          steps(model, &PushRow::displacement_error), line,
                          quoted(short_name(model.kind, model.name)));
    forces += fmt::format("{}${} using 1:2 with steps {}", forces.empty() ? "plot " : ", ",
                          steps(model, &PushRow::force_error), line);
    forces += fmt::format(", ${} using 1:2 with steps lw 0.8 lc rgb '{}'",
                          steps(model, &PushRow::force_error_unfloored), style.colour);
  }
  const std::string both =
      blocks + percent_axis("x", range.low(), range.high()) +
      "set xlabel 'error, %'\nset yrange [0:100]\nset ytics 0,25,100 format '%g %%'\n"
      "set arrow from graph 0, first 95 to graph 1, first 95 nohead lc rgb '#999999' dt 3\n"
      "set label '95 %' at graph 0.01, first 97.5 font ',11' tc rgb '#777777'\n"
      "set ylabel 'pushes with no larger error' offset 1,0\n" +
      kKeyAbove;
  return two_panels(both, title_of("displacement, of |d|") + fields + "\n",
                    "unset ylabel\nunset key\n" +
                        title_of("force, of itself (thin: light touches not floored)") + forces + "\n");
}

std::string error_over_push_plot(const OrganReport& organ) {
  constexpr int kQuarters = 4;
  const std::vector<Model> models = models_of(organ, is_random);
  const double reach = organ.max_displacement / organ.mean_edge;
  std::string blocks;
  std::string panels[2];
  Range range;
  int number = 0;
  for (const Model& model : models) {
    const MethodStyle& style = style_of(model.kind);
    double PushRow::*const errors[] = {&PushRow::displacement_error, &PushRow::force_error};
    for (size_t what = 0; what < 2; ++what) {
      std::vector<std::string> dots;
      std::vector<double> by_quarter[kQuarters];
      for (const PushRow* push : model.pushes) {
        const double error = percent(push->*errors[what]);
        range.add(error);
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
      blocks +=
          data_block(fmt::format("Dots{}", number), dots) + data_block(fmt::format("Bars{}", number), bars);
      panels[what] += fmt::format(
          "{0}$Dots{1} using 1:2 with points pt {2} ps 0.3 lc rgb '{3}', $Bars{1} using 1:2:3 with "
          "xerrorbars pt {2} ps {5} lw {6:.1f} lc "
          "rgb '{3}' title {4}",
          panels[what].empty() ? "plot " : ", ", number, style.marker, style.colour,
          quoted(short_name(model.kind, model.name)), 0.8 + 0.2 * model.of_kind, weight(model));
      ++number;
    }
  }
  const std::string both =
      blocks + "set bars 0\n" + percent_axis("y", range.low(), range.high()) +
      fmt::format("set xrange [0:{:g}]\nset xlabel '|d| / h'\nset ylabel 'error, %' offset 1.5,0\n", reach) +
      kKeyAbove;
  return two_panels(both, title_of("displacement, of |d|") + panels[0] + "\n",
                    "unset ylabel\nunset key\n" + title_of("force, of itself") + panels[1] + "\n");
}

std::string coverage_plot(const OrganReport& organ) {
  const std::vector<Model> models = models_of(
      organ, [](const PushRow& push) { return is_random(push) && push.displacement_estimate.has_value(); });
  std::string blocks;
  std::string panels[2];
  Range range;
  int number = 0;
  for (const Model& model : models) {
    const MethodStyle& style = style_of(model.kind);
    for (size_t what = 0; what < 2; ++what) {
      std::vector<std::string> dots;
      int covered = 0;
      for (const PushRow* push : model.pushes) {
        const double error = what == 0 ? push->displacement_error : push->force_error;
        const double estimate = what == 0 ? *push->displacement_estimate : *push->force_estimate;
        covered += error <= estimate ? 1 : 0;
        range.add(percent(error));
        range.add(percent(estimate));
        dots.push_back(fmt::format("{:g} {:g}", percent(estimate), percent(error)));
      }
      blocks += data_block(fmt::format("Dots{}", number), dots);
      panels[what] += fmt::format(", $Dots{} using 1:2 with points pt {} ps {:.2f} lc rgb '{}' title {}",
                                  number++, style.hollow_marker, 0.45 + 0.1 * model.of_kind, style.colour,
                                  quoted(fmt::format("{} {:.1f} %", short_name(model.kind, model.name),
                                                     100.0 * covered / static_cast<double>(dots.size()))));
    }
  }
  const double low = range.low();
  const double high = range.high();
  std::string both =
      blocks + percent_axis("x", low, high) + percent_axis("y", low, high) +
      "set xlabel 'error as the runtime estimates it, %'\nset ylabel 'error as it is, %' offset 1.5,0\n"
      "set key at graph 0.02, graph 0.98 left top vertical samplen 0.5\n";
  const std::string diagonal =
      fmt::format("plot {:g} <= x && x <= {:g} ? x : NaN with lines lw 1 lc rgb '#333333'", low, high);
  return two_panels(
      both, title_of("displacement: covered below the line") + diagonal + panels[0] + "\n",
      "unset ylabel\n" + title_of("force: covered below the line") + diagonal + panels[1] + "\n", 0.9);
}

std::string strain_plot(const OrganReport& organ) {
  constexpr double kEdges[] = {0, 0.05, 0.1, 0.2, 0.3};
  constexpr const char* kNames[] = {"to 5 %%", "5 to 10 %%", "10 to 20 %%", "20 to 30 %%", "beyond"};
  constexpr size_t kBins = std::size(kEdges);
  const std::vector<Model> models = models_of(organ, [](const PushRow& push) {
    return push.contacts == 1 && push.strain.has_value() && push.solved;
  });
  std::string blocks;
  std::string panels[2];
  std::string names;
  Range range;
  size_t counts[kBins] = {};
  int number = 0;
  for (const Model& model : models) {
    const MethodStyle& style = style_of(model.kind);
    std::vector<double> errors[2][kBins];
    for (const PushRow* push : model.pushes) {
      const auto bin =
          static_cast<size_t>(std::upper_bound(kEdges + 1, kEdges + kBins, *push->strain) - kEdges) - 1;
      errors[0][bin].push_back(percent(push->displacement_error));
      errors[1][bin].push_back(percent(push->force_error));
    }
    for (size_t what = 0; what < 2; ++what) {
      std::vector<std::string> lines;
      for (size_t bin = 0; bin < kBins; ++bin) {
        counts[bin] = errors[what][bin].size();
        if (counts[bin] == 0) continue;
        range.add(p95_of(errors[what][bin]));
        lines.push_back(fmt::format("{} {:g}", bin, p95_of(errors[what][bin])));
      }
      blocks += data_block(fmt::format("Bins{}", number), lines);
      panels[what] +=
          fmt::format("{}$Bins{} using 1:2 with linespoints pt {} ps 1 lw {:.1f} lc rgb '{}' dt {} title {}",
                      panels[what].empty() ? "plot " : ", ", number++, style.marker, weight(model),
                      style.colour, style.dash, quoted(short_name(model.kind, model.name)));
    }
  }
  for (size_t bin = 0; bin < kBins; ++bin) {
    if (counts[bin] > 0)
      names +=
          fmt::format("{}\"{}\\n{} pushes\" {}", names.empty() ? "" : ", ", kNames[bin], counts[bin], bin);
  }
  if (models.empty()) return "";
  const std::string both =
      blocks + percent_axis("y", range.low(), range.high()) +
      fmt::format("set xrange [-0.4:{}.4]\nset xtics ({})\nset ylabel 'error, p95, %' offset 1.5,0\n",
                  kBins - 1, names) +
      kKeyAbove;
  return two_panels(
      both, title_of("displacement, by strain |d| / thickness") + panels[0] + "\n",
      "unset ylabel\nunset key\n" + title_of("force, by strain |d| / thickness") + panels[1] + "\n");
}

}  // namespace palpate
