#include "offline/report/plot_style.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr MethodStyle kStyles[kMethodKinds] = {
    {"#e69f00", "linear_dd (EPFE)", 5, "2"},
    {"#0072b2", "polynomial_dd", 7, "1"},
    {"#009e73", "nonlinear_zone", 9, "4"},
    {"#333333", "full Newton, warm", 11, "5"},
};

}  // namespace

const MethodStyle& style_of(MethodKind kind) {
  return kStyles[static_cast<size_t>(kind)];
}

std::string short_name(MethodKind kind, const std::string& name) {
  switch (kind) {
    case MethodKind::linear:
      return "linear";
    case MethodKind::polynomial:
      return "polynomial";
    case MethodKind::zone:
      return "zone" + name.substr(std::min(name.find(','), name.size()));
    case MethodKind::newton:
      return "full Newton";
  }
  return name;
}

std::string data_block(const std::string& name, const std::vector<std::string>& lines) {
  std::string block = "$" + name + " << EOD\n";
  for (const std::string& line : lines) block += line + "\n";
  return block + "EOD\n";
}

std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'') {
      result += "''";
      continue;
    }
    if (c == '_' || c == '^' || c == '@' || c == '&' || c == '~' || c == '{' || c == '}') result += '\\';
    result += c;
  }
  return result + "'";
}

std::string percent_axis(const std::string& axis, double from, double to) {
  constexpr int kMostLabels = 7;  // from so many decades on, every second power has a label
  const int decades = static_cast<int>(std::lround(std::log10(decade_above(to) / decade_below(from))));
  const int step = decades >= kMostLabels ? 2 : 1;
  std::string tics;
  for (int exponent = static_cast<int>(std::lround(std::log10(decade_above(from) / 10)));
       std::pow(10, exponent) <= to * 1.001; ++exponent) {
    const std::string label =
        exponent % step == 0 ? fmt::format("{:.{}f}", std::pow(10, exponent), std::max(0, -exponent)) : "";
    tics += fmt::format("{}'{}' 1e{}", tics.empty() ? "" : ", ", label, exponent);
  }
  return fmt::format("set logscale {0}\nset {0}range [{1:g}:{2:g}]\nset {0}tics ({3})\n", axis, from, to,
                     tics);
}

std::string plot_frame() {
  return "set border 3 lc rgb '#555555'\n"
         "set tics nomirror tc rgb '#333333'\n"
         "set grid lc rgb '#dddddd' lt 1 lw 0.6\n"
         "set key noautotitle Left reverse\n";
}

double decade_below(double value) {
  return std::pow(10, std::floor(std::log10(value)));
}

double decade_above(double value) {
  return std::pow(10, std::ceil(std::log10(value)));
}

std::string push_size(const OrganReport& organ, double part) {
  const double size = part * organ.max_displacement;
  const std::string strain =
      organ.thickness > 0 ? fmt::format(", {:.3g} % strain", 100 * size / organ.thickness) : "";
  return fmt::format("{:.3g}{}{} ({:.2f} h{})", size, organ.length_unit.empty() ? "" : " ", organ.length_unit,
                     size / organ.mean_edge, strain);
}

}  // namespace palpate
