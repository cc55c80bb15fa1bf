// How methods look in every plot, on screen, in print and to colour-blind eyes: a colour of Okabe and Ito's set (2008,
// Color universal design), a marker and a dash each.
#pragma once

#include <string>
#include <vector>

#include "offline/report/report_data.hpp"

namespace palpate {

struct MethodStyle {
  const char* colour;
  const char* name;  // of its kind, for a legend
  int marker;        // gnuplot's number, filled
  int hollow_marker;
  const char* dash;  // gnuplot's dashtype
};

const MethodStyle& style_of(MethodKind kind);

// "linear", "polynomial", "zone, 2 rings": of a method that the pack carries; of others up to their first comma.
std::string short_name(const MethodRow& row);
std::string short_name(MethodKind kind, const std::string& name);

// A gnuplot data block "$NAME << EOD ... EOD" of these lines.
std::string data_block(const std::string& name, const std::vector<std::string>& lines);

// Text between single quotes in a script, with nothing in it for enhanced mode to read as markup.
std::string quoted(const std::string& text);

// A logarithmic axis of percents, with decimals at powers of ten.
std::string percent_axis(const std::string& axis, double from, double to);

// Grid, borders and fonts that all plots share.
std::string plot_frame();

// The next power of ten below, or above.
double decade_below(double value);
double decade_above(double value);

// "8.24 mm (1.00 h, 8 % strain)": strain over the thickness under the sites, where it is known.
std::string push_size(const OrganReport& organ, double part);

}  // namespace palpate
