#include "offline/output/canvas.hpp"

#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "offline/io/finished_file.hpp"

namespace palpate {
namespace {

void set_colour(cairo_t* context, const Colour& encoded) {
  cairo_set_source_rgb(context, encoded[0], encoded[1], encoded[2]);
}

// Returns a step of 1, 2 or 5 times a power of ten, for about five ticks from 0 to `largest`.
double round_step(double largest) {
  const double power = std::pow(10.0, std::floor(std::log10(largest / 4.0)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (largest / (factor * power) <= 6.0) return factor * power;
  return 10.0 * power;
}

double text_width(cairo_t* context, const std::string& text) {
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.c_str(), &extents);
  return extents.x_advance;
}

// Drops the last UTF-8 character.
void drop_last_character(std::string& text) {
  while (!text.empty() && (static_cast<unsigned char>(text.back()) & 0xC0U) == 0x80U) text.pop_back();
  if (!text.empty()) text.pop_back();
}

}  // namespace

struct Canvas::Surface {
  cairo_surface_t* image = nullptr;
  cairo_t* context = nullptr;
};

Canvas::Canvas(int width, int height, const Colour& background) : surface_(std::make_unique<Surface>()) {
  surface_->image = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
  surface_->context = cairo_create(surface_->image);
  if (const cairo_status_t status = cairo_status(surface_->context); status != CAIRO_STATUS_SUCCESS) {
    cairo_destroy(surface_->context);
    cairo_surface_destroy(surface_->image);
    throw std::runtime_error(
        fmt::format("no page of {} x {} pixels: {}", width, height, cairo_status_to_string(status)));
  }
  set_colour(surface_->context, background);
  cairo_paint(surface_->context);
  // Grey anti-aliasing without hinting makes the page independent of the screen.
  cairo_font_options_t* options = cairo_font_options_create();
  cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(surface_->context, options);
  cairo_font_options_destroy(options);
}

Canvas::~Canvas() {
  cairo_destroy(surface_->context);
  cairo_surface_destroy(surface_->image);
}

void Canvas::draw_image(const LinearImage& image, int left, int top) {
  cairo_surface_flush(surface_->image);
  unsigned char* page = cairo_image_surface_get_data(surface_->image);
  const int stride = cairo_image_surface_get_stride(surface_->image);
  const int right = std::min(image.width, cairo_image_surface_get_width(surface_->image) - left);
  const int bottom = std::min(image.height, cairo_image_surface_get_height(surface_->image) - top);
  for (int row = std::max(0, -top); row < bottom; ++row) {
    for (int column = std::max(0, -left); column < right; ++column) {
      const std::array<double, 4>& over =
          image.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                       static_cast<std::size_t>(column)];
      if (over[3] <= 0) continue;
      unsigned char* address =
          page + static_cast<std::ptrdiff_t>(top + row) * stride + std::ptrdiff_t{4} * (left + column);
      std::uint32_t pixel = 0;  // 0x00RRGGBB in the machine's byte order
      std::memcpy(&pixel, address, sizeof pixel);
      Colour mixed = to_linear(
          {((pixel >> 16U) & 255U) / 255.0, ((pixel >> 8U) & 255U) / 255.0, (pixel & 255U) / 255.0});
      for (std::size_t i = 0; i < 3; ++i) mixed[i] = mixed[i] * std::max(0.0, 1.0 - over[3]) + over[i];
      pixel = 0;
      for (const double part : to_encoded(mixed))
        pixel = pixel << 8U | static_cast<std::uint32_t>(std::lround(255.0 * part));
      std::memcpy(address, &pixel, sizeof pixel);
    }
  }
  cairo_surface_mark_dirty(surface_->image);
}

void Canvas::draw_text(const std::string& text, double x, double y, double max_width, TextStyle style) {
  cairo_t* context = surface_->context;
  cairo_select_font_face(context, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, style.size);
  std::string line = text;
  double width = text_width(context, line);
  if (width > max_width) {
    cairo_set_font_size(context, style.size * std::max(0.7, max_width / width));
    width = text_width(context, line);
    while (width > max_width * 1.001 && !line.empty() && line != "\u2026") {
      if (line.ends_with("\u2026")) drop_last_character(line);
      drop_last_character(line);
      line += "\u2026";
      width = text_width(context, line);
    }
  }
  const double shift = style.align == Align::kLeft ? 0.0 : style.align == Align::kCentre ? 0.5 : 1.0;
  set_colour(context, style.colour);
  cairo_move_to(context, x - shift * width, y);
  cairo_show_text(context, line.c_str());
}

void Canvas::draw_colour_bar(double x, double top, double width, double height, double largest,
                             double text_size, const std::function<Colour(double)>& encoded_colour) {
  cairo_t* context = surface_->context;
  const int rows = std::max(1, static_cast<int>(height));
  // Rounds to whole pixels: in pixels shared by two rows the page would show through.
  x = std::round(x);
  top = std::round(top);
  width = std::round(width);
  for (int row = 0; row < rows; ++row) {
    set_colour(context, encoded_colour(1.0 - (row + 0.5) / rows));
    cairo_rectangle(context, x, top + row, width, 1);
    cairo_fill(context);
  }
  TextStyle style{text_size, false, Align::kLeft, {0.30, 0.31, 0.34}};
  cairo_set_line_width(context, 1);
  const double step = largest > 0 ? round_step(largest) : 1.0;
  const int last = largest > 0 ? static_cast<int>(std::floor(largest / step * (1 + 1e-9))) : 0;
  std::vector<double> ticks;
  for (int tick = 0; tick <= last; ++tick) ticks.push_back(tick * step);
  // The largest value gets its own tick where space permits.
  if (largest - ticks.back() > 0.4 * step) ticks.push_back(largest);
  for (const double tick : ticks) {
    const double y = std::round(top + rows * (largest > 0 ? 1.0 - tick / largest : 1.0)) - 0.5;
    set_colour(context, style.colour);
    cairo_move_to(context, x + width, y);
    cairo_line_to(context, x + width + 0.35 * text_size, y);
    cairo_stroke(context);
    draw_text(fmt::format("{:.3g}", tick), x + width + 0.65 * text_size, y + 0.36 * text_size, 6 * text_size,
              style);
  }
}

PixelImage Canvas::pixels() const {
  cairo_surface_flush(surface_->image);
  PixelImage image{
      cairo_image_surface_get_width(surface_->image), cairo_image_surface_get_height(surface_->image), {}};
  const unsigned char* page = cairo_image_surface_get_data(surface_->image);
  const int stride = cairo_image_surface_get_stride(surface_->image);
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      std::uint32_t pixel = 0;  // 0x00RRGGBB in the machine's byte order
      std::memcpy(&pixel, page + static_cast<std::ptrdiff_t>(row) * stride + std::ptrdiff_t{4} * column,
                  sizeof pixel);
      image.pixels.push_back({static_cast<std::uint8_t>(pixel >> 16U & 255U),
                              static_cast<std::uint8_t>(pixel >> 8U & 255U),
                              static_cast<std::uint8_t>(pixel & 255U)});
    }
  }
  return image;
}

void Canvas::write_png(const std::filesystem::path& path) const {
  write_finished_file(path, [&](const std::filesystem::path& temporary) {
    errno = 0;
    const cairo_status_t status = cairo_surface_write_to_png(surface_->image, temporary.c_str());
    if (status != CAIRO_STATUS_SUCCESS) {
      const bool system = status == CAIRO_STATUS_WRITE_ERROR && errno != 0;
      throw std::runtime_error(path.string() + ": " +
                               (system ? std::strerror(errno) : cairo_status_to_string(status)));
    }
  });
}

}  // namespace palpate
