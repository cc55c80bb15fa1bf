// The style of each method in all plots: colour, marker and dash. Colours are from Okabe and Ito (2008, Color
// universal design), distinct in print and for colour-blind eyes.
#pragma once

#include <string>
#include <vector>

#include "offline/report/report_data.hpp"

namespace palpate {

struct MethodStyle {
  const char* colour;
  const char* name;  // name of the kind, for a legend
  int marker;        // gnuplot's number
  const char* dash;  // gnuplot's dashtype
};

const MethodStyle& style_of(MethodKind kind);

// Returns "linear", "polynomial", "zone, 2 rings" or "full Newton".
std::string short_name(MethodKind kind, const std::string& name);

// Formats a gnuplot data block "$NAME << EOD ... EOD".
std::string data_block(const std::string& name, const std::vector<std::string>& lines);

// Quotes text for a script and escapes the markup of gnuplot's enhanced mode.
std::string quoted(const std::string& text);

// Returns commands for a logarithmic percent axis ("x" or "y") with labels at powers of ten.
std::string percent_axis(const std::string& axis, double from, double to);

// Returns commands for grid, borders and key, common to all plots.
std::string plot_frame();

// Return the nearest power of ten that is not above, or not below, `value`.
double decade_below(double value);
double decade_above(double value);

// Formats "8.24 mm (1.00 h, 8 % strain)": strain relative to the thickness under the sites, where known.
std::string push_size(const OrganReport& organ, double part);

}  // namespace palpate
