// Which triangle is seen where: scan conversion with a depth buffer.
//
// The same few lines serve the eye (perspective) and every lamp (parallel light). All they need is that
// "nearness" is linear over a projected triangle, which holds for 1/z under a perspective and for -z under a
// parallel projection.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

struct ScreenPoint {
  double x = 0;         // samples, to the right from the left border
  double y = 0;         // samples, down from the upper border
  double nearness = 0;  // larger is nearer
};

struct VisibilityBuffer {
  static constexpr int kNothing = -1;

  VisibilityBuffer(int width_in_samples, int height_in_samples);
  void clear();
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }

  int width;
  int height;
  std::vector<float> nearness;  // of what is seen at each sample, -infinity where nothing is
  std::vector<int> triangle;    // its number, kNothing where nothing is
};

// Draws triangles over what the buffer holds. Both sides are visible: an open surface has no inside. A sample
// is covered when its centre (x + 0.5, y + 0.5) is; of two triangles equally near the first drawn stays.
void rasterise(std::span<const ScreenPoint> points, std::span<const std::array<int, 3>> triangles,
               VisibilityBuffer& buffer);

}  // namespace palpate
