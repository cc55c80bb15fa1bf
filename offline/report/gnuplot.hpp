// Runs gnuplot (http://www.gnuplot.info) to draw scripts as SVG.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

// Throws std::runtime_error with the package to install where gnuplot is absent.
void require_gnuplot();

// Writes `script` as FILE.gp and its drawing as FILE.svg. Throws std::runtime_error with gnuplot's complaint.
void draw_plot(const std::string& script, int width, int height, const std::filesystem::path& file);

}  // namespace palpate
