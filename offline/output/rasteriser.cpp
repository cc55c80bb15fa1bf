#include "offline/output/rasteriser.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {
namespace {

constexpr double kSeam = 1e-10;  // tolerance of barycentric coordinates; closes holes on common edges

int clamp_sample(double value, int count) {
  return static_cast<int>(std::clamp(std::floor(value), 0.0, static_cast<double>(count)));
}

}  // namespace

VisibilityBuffer::VisibilityBuffer(int width_in_samples, int height_in_samples)
    : width(width_in_samples), height(height_in_samples) {
  clear();
}

void VisibilityBuffer::clear() {
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  nearness.assign(count, -std::numeric_limits<float>::infinity());
  triangle.assign(count, kNothing);
}

void rasterise(std::span<const ScreenPoint> points, std::span<const std::array<int, 3>> triangles,
               VisibilityBuffer& buffer) {
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const ScreenPoint& a = points[static_cast<std::size_t>(triangles[t][0])];
    const ScreenPoint& b = points[static_cast<std::size_t>(triangles[t][1])];
    const ScreenPoint& c = points[static_cast<std::size_t>(triangles[t][2])];
    const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);  // twice the signed area
    if (area == 0.0 || !std::isfinite(area)) continue;
    const int left = clamp_sample(std::min({a.x, b.x, c.x}), buffer.width);
    const int right = clamp_sample(std::max({a.x, b.x, c.x}) + 1.0, buffer.width);
    const int top = clamp_sample(std::min({a.y, b.y, c.y}), buffer.height);
    const int bottom = clamp_sample(std::max({a.y, b.y, c.y}) + 1.0, buffer.height);
    // Barycentric coordinates on the screen, linear in x and y; positive inside for either winding.
    const double a_per_x = (b.y - c.y) / area, a_per_y = (c.x - b.x) / area;
    const double b_per_x = (c.y - a.y) / area, b_per_y = (a.x - c.x) / area;
    for (int y = top; y < bottom; ++y) {
      const double row = y + 0.5;
      const double a_in_row = (row - c.y) * a_per_y, b_in_row = (row - c.y) * b_per_y;
      const std::size_t first = buffer.at(0, y);
      for (int x = left; x < right; ++x) {
        const double from_c = x + 0.5 - c.x;
        const double share_a = from_c * a_per_x + a_in_row;
        const double share_b = from_c * b_per_x + b_in_row;
        const double share_c = 1.0 - share_a - share_b;
        if (share_a < -kSeam || share_b < -kSeam || share_c < -kSeam) continue;
        const auto nearness =
            static_cast<float>(share_a * a.nearness + share_b * b.nearness + share_c * c.nearness);
        const std::size_t sample = first + static_cast<std::size_t>(x);
        if (nearness > buffer.nearness[sample]) {
          buffer.nearness[sample] = nearness;
          buffer.triangle[sample] = static_cast<int>(t);
        }
      }
    }
  }
}

}  // namespace palpate
