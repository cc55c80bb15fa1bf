#include "offline/output/organ_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <stdexcept>

#include "offline/output/camera.hpp"
#include "offline/output/canvas.hpp"
#include "offline/output/renderer.hpp"
#include "offline/output/tool_shape.hpp"
#include "offline/output/viewpoint.hpp"

namespace palpate {
namespace {

constexpr Colour kTissue = {0.86, 0.66, 0.64};  // encoded, grey-pink
constexpr Colour kTool = {0.84, 0.24, 0.16};    // encoded; the colour map has no similar hue
constexpr double kLargestNumber = 1e100;        // larger lengths overflow in products
constexpr double kGhost = 0.16;                 // opacity of a tool behind tissue

void check_finite(const Eigen::Vector3d& value, const char* what, std::size_t number) {
  if (!value.allFinite()) throw std::invalid_argument(fmt::format("the {} {} is not finite", what, number));
  if (value.cwiseAbs().maxCoeff() > kLargestNumber)
    throw std::invalid_argument(fmt::format("the {} {} is larger than {:.0e}", what, number, kLargestNumber));
}

void check(const PictureInput& input, const PictureOptions& options) {
  if (input.rest.size() != input.displacement.size())
    throw std::invalid_argument(
        fmt::format("{} nodes at rest, but {} displacements", input.rest.size(), input.displacement.size()));
  for (std::size_t node = 0; node < input.rest.size(); ++node) {
    check_finite(input.rest[node], "rest position of node", node);
    check_finite(input.displacement[node], "displacement of node", node);
  }
  for (std::size_t t = 0; t < input.triangles.size(); ++t)
    for (const int node : input.triangles[t])
      if (node < 0 || static_cast<std::size_t>(node) >= input.rest.size())
        throw std::invalid_argument(
            fmt::format("triangle {} names node {} of {}", t, node, input.rest.size()));
  for (std::size_t i = 0; i < input.tools.size(); ++i) {
    check_finite(input.tools[i].position, "position of tool", i);
    check_finite(input.tools[i].displacement, "displacement of tool", i);
    if (!std::isfinite(input.tools[i].radius) || input.tools[i].radius < 0)
      throw std::invalid_argument(fmt::format("tool {} has radius {}", i, input.tools[i].radius));
  }
  if (std::min(options.width, options.height) < 200 || std::max(options.width, options.height) > 10000)
    throw std::invalid_argument(
        fmt::format("a picture of {} x {} pixels; 200 to 10000 are possible", options.width, options.height));
  const auto is_direction = [](const Eigen::Vector3d& v) { return v.allFinite() && v.stableNorm() > 0; };
  if (!is_direction(options.up)) throw std::invalid_argument("the up direction is zero or not finite");
  if (options.view_direction && !is_direction(*options.view_direction))
    throw std::invalid_argument("the view direction is zero or not finite");
}

// The drawn part of the input: nodes of triangles, relative to `centre`. A distant origin costs no digits.
struct DrawnOrgan {
  std::vector<Eigen::Vector3d> rest, pushed;
  std::vector<double> distance;  // |displacement| of each node, length unit
  std::vector<std::array<int, 3>> triangles;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // the first node
};

DrawnOrgan drawn_part(const PictureInput& input) {
  DrawnOrgan organ;
  std::vector<int> new_index(input.rest.size(), -1);
  for (const std::array<int, 3>& triangle : input.triangles) {
    std::array<int, 3> renamed;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto node = static_cast<std::size_t>(triangle[k]);
      if (new_index[node] < 0) {
        new_index[node] = static_cast<int>(organ.rest.size());
        if (organ.rest.empty()) organ.centre = input.rest[node];
        organ.rest.push_back(input.rest[node] - organ.centre);
        organ.pushed.push_back(organ.rest.back() + input.displacement[node]);
        organ.distance.push_back(input.displacement[node].stableNorm());
      }
      renamed[k] = new_index[node];
    }
    organ.triangles.push_back(renamed);
  }
  return organ;
}

// Blends an image of the tools alone into `image`, so that a tool behind tissue shows faintly.
void add_ghost(LinearImage& image, const LinearImage& tools) {
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const double share = kGhost * tools.pixels[i][3];
    if (share <= 0) continue;
    for (std::size_t part = 0; part < 4; ++part)
      image.pixels[i][part] = (1.0 - share) * image.pixels[i][part] + kGhost * tools.pixels[i][part];
  }
}

// Returns the middle of the points' extent on the screen, pixels from the panel's left border.
double middle_on_screen(const std::vector<Eigen::Vector3d>& points, const Camera& camera, int panel_width) {
  if (points.empty()) return 0.5 * panel_width;
  double low = panel_width, high = 0;
  for (const Eigen::Vector3d& point : points) {
    low = std::min(low, camera.project(point).x);
    high = std::max(high, camera.project(point).x);
  }
  return 0.5 * (low + high);
}

// Layout of the page in pixels. `text`: size of the labels; `middle`: border between the panels.
struct PageLayout {
  double text, margin;
  int top, bottom, left, middle, panel_width, panel_height;
};

PageLayout lay_out(const PictureInput& input, const PictureOptions& options) {
  const double text = std::min(options.width / 80.0, options.height / 36.0);
  const double margin = 1.6 * text;
  const double bar_width = 7.0 * text;
  const int top = static_cast<int>(input.title.empty() ? margin : 4.2 * text);
  const int bottom = static_cast<int>(options.height - (input.caption.empty() ? 3.2 * text : 5.2 * text));
  const int panel_width = static_cast<int>((options.width - 2.0 * margin - bar_width) / 2.0);
  const int left = static_cast<int>(margin);
  return {text, margin, top, bottom, left, left + panel_width, panel_width, bottom - top};
}

// Draws the colour bar and all texts. `label_x`: middle of the organ, pixels from the panel's left border.
void annotate(Canvas& canvas, const PictureInput& input, const PictureOptions& options,
              const PageLayout& page, double largest, double label_x) {
  const auto& [text, margin, top, bottom, left, middle, panel_width, panel_height] = page;
  const double bar_height = 0.62 * panel_height;
  const double bar_left = middle + panel_width + 2.0 * text;
  const double bar_top = top + 0.5 * (panel_height - bar_height);
  canvas.draw_colour_bar(bar_left, bar_top, 1.2 * text, bar_height, largest, 0.85 * text, shaded_colour);
  const TextStyle label{text, false, Align::kCentre, {0.30, 0.31, 0.34}};
  canvas.draw_text(options.rest_label, left + label_x, bottom + 1.3 * text, panel_width, label);
  canvas.draw_text(options.pushed_label, middle + label_x, bottom + 1.3 * text, panel_width, label);
  TextStyle bar_label = label;
  bar_label.size = 0.85 * text;
  bar_label.align = Align::kRight;
  canvas.draw_text(input.length_unit.empty() ? "displacement" : "displacement, " + input.length_unit,
                   options.width - margin, bar_top - text, 10 * text, bar_label);
  const double line_width = options.width - 2.0 * margin;
  canvas.draw_text(input.title, margin, 2.7 * text, line_width, {1.5 * text, true, Align::kLeft});
  canvas.draw_text(input.caption, margin, options.height - 1.3 * text, line_width,
                   {0.95 * text, false, Align::kLeft, {0.30, 0.31, 0.34}});
}

std::unique_ptr<Canvas> compose(const PictureInput& input, const PictureOptions& options) {
  check(input, options);
  const DrawnOrgan organ = drawn_part(input);
  const double largest =
      organ.distance.empty() ? 0.0 : *std::max_element(organ.distance.begin(), organ.distance.end());

  std::vector<Eigen::Vector3d> shown = organ.rest;
  shown.insert(shown.end(), organ.pushed.begin(), organ.pushed.end());
  const double scale = scene_radius(shown);
  std::vector<LitSurface> tools;
  std::optional<PlacedTool> first_tool;
  for (const PictureTool& tool : input.tools) {
    const PlacedTool placed = place_tool(tool.position - organ.centre, tool.displacement, tool.radius,
                                         organ.rest, organ.triangles, scale);
    if (!first_tool) first_tool = placed;
    tools.push_back(tool_surface(placed, to_linear(kTool)));
    shown.insert(shown.end(), tools.back().points.begin(), tools.back().points.end());
  }
  const PageLayout page = lay_out(input, options);
  const Eigen::Vector3d view =
      options.view_direction
          ? *options.view_direction
          : automatic_view(organ.pushed, organ.triangles, organ.distance, first_tool, options.up);
  const Camera camera =
      fit_camera(shown, view, options.up, page.panel_width, page.panel_height, 0.9 * page.text);
  const LitSurface rest{
      organ.rest, organ.triangles, organ.distance, [](double) { return to_linear(kTissue); }, 0.16, 0.13};
  const auto colour = [largest](double distance) {
    return to_linear(shaded_colour(largest > 0 ? distance / largest : 0.0));
  };
  LitSurface pushed{organ.pushed, organ.triangles, organ.distance, colour, 0.03, 0.20};
  std::vector<LitSurface> pushed_scene = tools;
  pushed_scene.push_back(std::move(pushed));
  LinearImage pushed_image = render(pushed_scene, camera, page.panel_width, page.panel_height);
  add_ghost(pushed_image, render(tools, camera, page.panel_width, page.panel_height));

  auto canvas = std::make_unique<Canvas>(options.width, options.height, kPage);
  canvas->draw_image(render(std::span(&rest, 1), camera, page.panel_width, page.panel_height), page.left,
                     page.top);
  canvas->draw_image(pushed_image, page.middle, page.top);
  annotate(*canvas, input, options, page, largest, middle_on_screen(organ.rest, camera, page.panel_width));
  return canvas;
}

}  // namespace

PixelImage draw_before_after(const PictureInput& input, const PictureOptions& options) {
  return compose(input, options)->pixels();
}

void write_before_after(const PictureInput& input, const PictureOptions& options,
                        const std::filesystem::path& png) {
  compose(input, options)->write_png(png);
}

}  // namespace palpate
