// A page on which a figure is put together: rendered images, text, a colour bar. Coordinates are pixels from
// the upper left corner.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "offline/output/colour_map.hpp"
#include "offline/output/renderer.hpp"

namespace palpate {

// Encoded red, green, blue, row by row from the upper left corner.
struct PixelImage {
  int width = 0;
  int height = 0;
  std::vector<std::array<std::uint8_t, 3>> pixels;
};

enum class Align { kLeft, kCentre, kRight };

struct TextStyle {
  double size = 16;  // pixels
  bool bold = false;
  Align align = Align::kLeft;
  Colour colour = {0.13, 0.14, 0.16};  // encoded
};

class Canvas {
 public:
  // Filled with `background` (encoded). Throws std::runtime_error if there is no memory for it.
  Canvas(int width, int height, const Colour& background);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  // Lays `image` over the page, its upper left corner at (left, top), mixed in linear light.
  void draw_image(const LinearImage& image, int left, int top);

  // One line with its baseline at y. Where it is wider than max_width it is set smaller, down to 70 %, then
  // cut with an ellipsis.
  void draw_text(const std::string& text, double x, double y, double max_width, TextStyle style);

  // A vertical bar, its left border at x, with ticks on its right at round values from 0 to `largest`. Where
  // `largest` is 0 the bar has the one tick 0.
  void draw_colour_bar(double x, double top, double width, double height, double largest, double text_size,
                       const std::function<Colour(double)>& encoded_colour);

  PixelImage pixels() const;

  // Throws std::runtime_error "PATH: REASON". The file appears whole or not at all.
  void write_png(const std::filesystem::path& path) const;

 private:
  struct Surface;
  std::unique_ptr<Surface> surface_;
};

}  // namespace palpate
