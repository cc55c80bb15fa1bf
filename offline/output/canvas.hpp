// A page of a figure: rendered images, text, a colour bar. Coordinates: pixels from the upper left corner.
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
  // Fills the page with `background` (encoded). Throws std::runtime_error when memory runs out.
  Canvas(int width, int height, const Colour& background);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  // Draws `image` with its upper left corner at (left, top); blends in linear light.
  void draw_image(const LinearImage& image, int left, int top);

  // Draws a line with its baseline at y. Wider text than max_width shrinks to 70 %, then ends in an ellipsis.
  void draw_text(const std::string& text, double x, double y, double max_width, TextStyle style);

  // Draws a vertical bar right of x, with ticks at round values from 0 to `largest`; a single tick for 0.
  void draw_colour_bar(double x, double top, double width, double height, double largest, double text_size,
                       const std::function<Colour(double)>& encoded_colour);

  PixelImage pixels() const;

  // Throws std::runtime_error "PATH: REASON". Writes the whole file or none.
  void write_png(const std::filesystem::path& path) const;

 private:
  struct Surface;
  std::unique_ptr<Surface> surface_;
};

}  // namespace palpate
