#include "bench/peers/elsewhere_picture.hpp"

#include <algorithm>

#include "offline/output/camera.hpp"
#include "offline/output/canvas.hpp"
#include "offline/output/renderer.hpp"
#include "offline/output/tool_shape.hpp"
#include "offline/output/viewpoint.hpp"

namespace palpate::peers {
namespace {

constexpr int kWidth = 1740;
constexpr int kHeight = 560;
constexpr double kText = 15;                   // pixels
constexpr double kFirstColour = 0.25;          // below, the map is so dark that the colour hides the shading
constexpr Colour kProbe = {0.84, 0.24, 0.16};  // encoded
constexpr Colour kPrepared = {0.95, 0.95, 0.97};  // encoded
constexpr double kGhost = 0.35;                   // opacity of a ball behind tissue

Colour displacement_colour(double share) {
  return viridis(kFirstColour + (1.0 - kFirstColour) * share);
}

std::vector<Eigen::Vector3d> moved(const std::vector<Eigen::Vector3d>& rest,
                                   const std::vector<Eigen::Vector3d>& displacement) {
  std::vector<Eigen::Vector3d> points(rest);
  for (size_t i = 0; i < points.size(); ++i) points[i] += displacement[i];
  return points;
}

void add_ghost(LinearImage& image, const LinearImage& balls) {
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    const double share = kGhost * balls.pixels[i][3];
    for (size_t part = 0; part < 4; ++part)
      image.pixels[i][part] = (1.0 - share) * image.pixels[i][part] + kGhost * balls.pixels[i][part];
  }
}

}  // namespace

void write_elsewhere_picture(const ElsewherePicture& picture, const std::filesystem::path& png) {
  double largest = 0;
  for (const ElsewherePicture::Panel& panel : picture.panels) {
    for (const Eigen::Vector3d& u : panel.displacement) largest = std::max(largest, u.norm());
  }
  const double scale = scene_radius(picture.rest);
  const auto node = [](int index) { return static_cast<size_t>(index); };
  const PlacedTool probe = place_tool(picture.rest[node(picture.touched)], picture.probe, 0, picture.rest,
                                      picture.triangles, scale);
  const LitSurface probe_shape = tool_surface(probe, to_linear(kProbe));

  const int top = static_cast<int>(3.2 * kText);
  const int bottom = static_cast<int>(kHeight - 3.0 * kText);
  const int left = static_cast<int>(kText);
  const int panel_width =
      static_cast<int>((kWidth - 2.0 * kText - 7.0 * kText) / static_cast<double>(picture.panels.size()));
  std::vector<double> distance;  // in the middle panel, the subject of the figure
  for (const Eigen::Vector3d& u : picture.panels[1].displacement) distance.push_back(u.norm());
  std::vector<Eigen::Vector3d> shown = moved(picture.rest, picture.panels[1].displacement);
  const Eigen::Vector3d view =
      automatic_view(shown, picture.triangles, distance, probe, Eigen::Vector3d::UnitZ());
  shown.insert(shown.end(), picture.rest.begin(), picture.rest.end());
  shown.insert(shown.end(), probe_shape.points.begin(), probe_shape.points.end());
  const Camera camera =
      fit_camera(shown, view, Eigen::Vector3d::UnitZ(), panel_width, bottom - top, 0.9 * kText);

  Canvas canvas(kWidth, kHeight, {1, 1, 1});
  const auto colour = [largest](double value) {
    return to_linear(displacement_colour(largest > 0 ? value / largest : 0.0));
  };
  for (size_t p = 0; p < picture.panels.size(); ++p) {
    const ElsewherePicture::Panel& panel = picture.panels[p];
    const int panel_left = left + static_cast<int>(p) * panel_width;
    // Draws S as a ball on the deformed surface.
    PlacedTool prepared = place_tool(picture.rest[node(picture.prepared)], {0, 0, 0}, 0, picture.rest,
                                     picture.triangles, scale);
    prepared.ball_centre += panel.displacement[node(picture.prepared)];
    const std::vector<LitSurface> balls = {probe_shape, tool_surface(prepared, to_linear(kPrepared))};
    std::vector<LitSurface> scene = balls;
    LitSurface tissue{moved(picture.rest, panel.displacement), picture.triangles, {}, colour, 0.03, 0.20};
    for (const Eigen::Vector3d& u : panel.displacement) tissue.values.push_back(u.norm());
    scene.push_back(std::move(tissue));
    LinearImage image = render(scene, camera, panel_width, bottom - top);
    add_ghost(image, render(balls, camera, panel_width, bottom - top));
    canvas.draw_image(image, panel_left, top);
    const auto write_label = [&](const PlacedTool& tool, const char* text) {
      const ScreenPoint centre = camera.project(tool.ball_centre);
      const auto write = [&](double right, double down, const Colour& ink) {
        canvas.draw_text(text, panel_left + centre.x + 1.0 * kText + right,
                         top + centre.y + 1.4 * kText + down, 2 * kText,
                         {1.3 * kText, true, Align::kLeft, ink});
      };
      for (const double right : {-1.5, 0.0, 1.5}) {
        for (const double down : {-1.5, 0.0, 1.5}) write(right, down, {1, 1, 1});
      }
      write(0, 0, {0.13, 0.14, 0.16});
    };
    write_label(prepared, "S");
    write_label(probe, "T");
    canvas.draw_text(panel.label, panel_left + 0.5 * panel_width, bottom + 1.5 * kText, panel_width - kText,
                     {kText, false, Align::kCentre, {0.30, 0.31, 0.34}});
  }
  const double bar_height = 0.62 * (bottom - top);
  const double bar_top = top + 0.5 * (bottom - top - bar_height);
  canvas.draw_colour_bar(left + static_cast<int>(picture.panels.size()) * panel_width + 2.0 * kText, bar_top,
                         1.2 * kText, bar_height, largest, 0.85 * kText, displacement_colour);
  canvas.draw_text("displacement, " + picture.length_unit, kWidth - kText, bar_top - kText, 11 * kText,
                   {0.85 * kText, false, Align::kRight, {0.30, 0.31, 0.34}});
  canvas.draw_text(picture.title, kText, 2.1 * kText, kWidth - 2 * kText, {1.4 * kText, true, Align::kLeft});
  canvas.write_png(png);
}

}  // namespace palpate::peers
