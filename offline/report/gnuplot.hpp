// Plots by gnuplot (http://www.gnuplot.info), which draws what a script says as SVG.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

// Throws std::runtime_error with the package to install where there is no gnuplot.
void require_gnuplot();

// Writes `script` as FILE.gp, runs it, and writes what it draws as FILE.svg, so that a plot can be drawn again by hand.
// Throws std::runtime_error with gnuplot's first complaint.
void draw_plot(const std::string& script, int width, int height, const std::filesystem::path& file);

}  // namespace palpate
