#include "offline/output/value_maps.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <stdexcept>

#include "offline/output/camera.hpp"
#include "offline/output/renderer.hpp"
#include "offline/output/viewpoint.hpp"

namespace palpate {
namespace {

void check(const ValueMapPicture& picture) {
  for (const Eigen::Vector3d& point : picture.points) {
    if (!point.allFinite()) throw std::invalid_argument("a point of a value map is not finite");
  }
  for (const std::array<int, 3>& triangle : picture.triangles) {
    for (const int corner : triangle) {
      if (corner < 0 || static_cast<size_t>(corner) >= picture.points.size())
        throw std::invalid_argument("a triangle of a value map names a point that is not there");
    }
  }
  for (const ValueMap& map : picture.maps) {
    if (map.values.size() != picture.points.size())
      throw std::invalid_argument("a value map needs a value for each point");
    if (!std::all_of(map.values.begin(), map.values.end(),
                     [](double value) { return std::isfinite(value) && value >= 0; }))
      throw std::invalid_argument("a value of a value map is negative or not finite");
  }
}

}  // namespace

void write_value_maps(const ValueMapPicture& picture, const std::filesystem::path& png) {
  check(picture);
  const double text = picture.panel_height / 30.0;
  const int margin = static_cast<int>(1.5 * text);
  const int bar_width = static_cast<int>(7 * text);
  const int foot = static_cast<int>(3 * text);
  const int width = picture.panel_width - bar_width - margin;
  const int height = picture.panel_height - foot - margin;
  const Eigen::Vector3d view =
      picture.towards.norm() > 0
          ? picture.towards
          : automatic_view(picture.points, picture.triangles, {}, std::nullopt, Eigen::Vector3d::UnitZ());
  const Camera camera = fit_camera(picture.points, view, Eigen::Vector3d::UnitZ(), width, height, text);
  Canvas canvas(picture.panel_width * static_cast<int>(picture.maps.size()), picture.panel_height, kPage);
  int left = 0;
  for (const ValueMap& map : picture.maps) {
    const double largest = *std::max_element(map.values.begin(), map.values.end());
    const LitSurface surface{
        picture.points,
        picture.triangles,
        map.values,
        [largest](double value) { return to_linear(shaded_colour(largest > 0 ? value / largest : 0)); },
        0.03,
        0.2};
    canvas.draw_image(render(std::span(&surface, 1), camera, width, height), left + margin, margin);
    const double bar_height = 0.6 * height;
    const double bar_left = left + margin + width + text;
    const double bar_top = margin + 0.5 * (height - bar_height);
    canvas.draw_colour_bar(bar_left, bar_top, 1.2 * text, bar_height, largest, 0.85 * text, shaded_colour);
    const Colour grey = {0.30, 0.31, 0.34};
    canvas.draw_text(picture.bar_label, bar_left, bar_top - text, bar_width,
                     {0.85 * text, false, Align::kLeft, grey});
    canvas.draw_text(map.label, left + margin + 0.5 * width, picture.panel_height - 1.2 * text, width,
                     {text, false, Align::kCentre, grey});
    left += picture.panel_width;
  }
  canvas.write_png(png);
}

}  // namespace palpate
