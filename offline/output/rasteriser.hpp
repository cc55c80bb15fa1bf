// Finds the visible triangle of each sample: scan conversion with a depth buffer.
//
// The eye (perspective) and every lamp (parallel light) use this code. "Nearness" must be linear over a
// projected triangle: 1/z in perspective, -z in parallel projection.
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
  std::vector<float> nearness;  // nearness of the visible surface; -infinity where empty
  std::vector<int> triangle;    // number of the visible triangle; kNothing where empty
};

// Draws triangles into the buffer; both sides are visible. A triangle covers a sample whose centre (x + 0.5,
// y + 0.5) lies inside. The first of equally near triangles stays.
void rasterise(std::span<const ScreenPoint> points, std::span<const std::array<int, 3>> triangles,
               VisibilityBuffer& buffer);

}  // namespace palpate
