#include "offline/output/renderer.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "offline/output/lighting.hpp"
#include "offline/output/shading_normals.hpp"

namespace palpate {
namespace {

constexpr int kSamples = 4;             // along each side of a pixel
constexpr int kOutlineReach = 5;        // samples; outlines are about 1.2 pixels wide
constexpr double kOutlineDepth = 0.02;  // least step in depth of an outline, in radii of the scene
constexpr double kOutlineDarkness = 0.62;
constexpr double kMeshLineWidth = 0.9;  // pixels, half on each side of the edge

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

// All surfaces in one list, so that they hide and shade each other.
struct MergedScene {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 3>> triangles;
  std::vector<double> values;
  std::vector<std::size_t> surface;  // surface of each triangle
};

MergedScene merge(std::span<const LitSurface> surfaces) {
  MergedScene scene;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const int first = static_cast<int>(scene.points.size());
    scene.points.insert(scene.points.end(), surfaces[s].points.begin(), surfaces[s].points.end());
    scene.values.insert(scene.values.end(), surfaces[s].values.begin(), surfaces[s].values.end());
    for (const auto& [a, b, c] : surfaces[s].triangles) {
      scene.triangles.push_back({first + a, first + b, first + c});
      scene.surface.push_back(s);
    }
  }
  return scene;
}

// The part of one triangle in one pixel.
struct Fragment {
  std::size_t pixel = 0;
  int triangle = 0;
  double x = 0, y = 0;  // centre of its samples, in samples; inside the triangle, as triangles are convex
  double coverage = 0;  // fraction of the pixel
  double outline = 0;   // share of its samples that lie on an outline
  std::array<double, 3> corners = {};  // barycentric coordinates on the triangle in space
  double mesh_line = 0;                // 1 on an edge of the mesh, 0 away from edges
};

// Whether a sample lies on an outline: kOutlineReach away nothing is visible, or the surface is deeper, by
// more than `step`, than its slope explains. An outline thus lies on the near surface.
bool on_outline(const VisibilityBuffer& buffer, int x, int y, double step) {
  const double depth = 1.0 / static_cast<double>(buffer.nearness[buffer.at(x, y)]);
  const auto depth_at = [&](int column, int row) {  // negative where empty
    if (column < 0 || row < 0 || column >= buffer.width || row >= buffer.height) return depth;
    const std::size_t sample = buffer.at(column, row);
    return buffer.triangle[sample] == VisibilityBuffer::kNothing
               ? -1.0
               : 1.0 / static_cast<double>(buffer.nearness[sample]);
  };
  for (const auto& [dx, dy] : {std::array{1, 0}, std::array{-1, 0}, std::array{0, 1}, std::array{0, -1}}) {
    const double beside = depth_at(x + kOutlineReach * dx, y + kOutlineReach * dy);
    if (beside < 0) return true;
    const double opposite = depth_at(x - kOutlineReach * dx, y - kOutlineReach * dy);
    const double slope = opposite < 0 ? 0.0 : std::max(0.0, depth - opposite);
    if (beside - depth - slope > step) return true;
  }
  return false;
}

void place_on_triangle(Fragment& fragment, const MergedScene& scene, std::span<const ScreenPoint> projected) {
  std::array<ScreenPoint, 3> corner;
  for (std::size_t k = 0; k < 3; ++k)
    corner[k] = projected[index(scene.triangles[index(fragment.triangle)][k])];
  const auto doubled_area = [](const ScreenPoint& a, const ScreenPoint& b, double x, double y) {
    return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
  };
  const double area = doubled_area(corner[0], corner[1], corner[2].x, corner[2].y);
  double sum = 0;
  double edge_distance = 1e9;  // samples
  for (std::size_t k = 0; k < 3; ++k) {
    const ScreenPoint& a = corner[(k + 1) % 3];
    const ScreenPoint& b = corner[(k + 2) % 3];
    const double share = std::clamp(doubled_area(a, b, fragment.x, fragment.y) / area, 0.0, 1.0);
    edge_distance =
        std::min(edge_distance, share * std::abs(area) / std::max(1e-12, std::hypot(b.x - a.x, b.y - a.y)));
    // Perspective correction: corners_k = share_k w_k / sum(share_i w_i), w the nearness.
    fragment.corners[k] = share * corner[k].nearness;
    sum += fragment.corners[k];
  }
  for (double& part : fragment.corners) part /= sum;
  fragment.mesh_line = std::clamp(kMeshLineWidth - edge_distance / kSamples, 0.0, 1.0);
}

std::vector<Fragment> collect_fragments(const VisibilityBuffer& buffer, const MergedScene& scene,
                                        std::span<const ScreenPoint> projected, int width, int height) {
  const double step = kOutlineDepth * scene_radius(scene.points);
  constexpr double kShare = 1.0 / (kSamples * kSamples);
  std::vector<Fragment> fragments;
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const std::size_t first = fragments.size();
      for (int i = 0; i < kSamples * kSamples; ++i) {
        const int x = column * kSamples + i % kSamples;
        const int y = row * kSamples + i / kSamples;
        const int triangle = buffer.triangle[buffer.at(x, y)];
        if (triangle == VisibilityBuffer::kNothing) continue;
        std::size_t f = first;
        while (f < fragments.size() && fragments[f].triangle != triangle) ++f;
        if (f == fragments.size()) {
          fragments.emplace_back();
          fragments[f].pixel = index(row) * index(width) + index(column);
          fragments[f].triangle = triangle;
        }
        fragments[f].x += x + 0.5;
        fragments[f].y += y + 0.5;
        fragments[f].coverage += kShare;
        if (on_outline(buffer, x, y, step)) fragments[f].outline += kShare;
      }
      for (std::size_t f = first; f < fragments.size(); ++f) {
        Fragment& fragment = fragments[f];
        fragment.x *= kShare / fragment.coverage;
        fragment.y *= kShare / fragment.coverage;
        fragment.outline /= fragment.coverage;
        place_on_triangle(fragment, scene, projected);
      }
    }
  }
  return fragments;
}

// Adds a Blinn-Phong highlight, a tight lobe on a wide lobe, to the diffuse light and darkens outlines.
Colour shade(const LitSurface& surface, double value, const LitPoint& point, const ReceivedLight& received,
             const Fragment& fragment, const Camera& camera) {
  const Eigen::Vector3d to_eye = (camera.eye - point.position).normalized();
  const Eigen::Vector3d halfway = (to_eye + key_direction(camera)).normalized();
  const double highlight = surface.gloss * received.key_visibility *
                           (0.7 * std::pow(std::max(0.0, point.normal.dot(halfway)), 48.0) +
                            0.3 * std::pow(std::max(0.0, point.normal.dot(halfway)), 10.0));
  const double ink =
      (1.0 - kOutlineDarkness * fragment.outline) * (1.0 - surface.mesh_lines * fragment.mesh_line);
  Colour colour = surface.colour(value);
  for (std::size_t i = 0; i < 3; ++i)
    colour[i] = std::min(1.0, ink * (colour[i] * received.diffuse[i] + highlight));
  return colour;
}

}  // namespace

LinearImage render(std::span<const LitSurface> surfaces, const Camera& camera, int width, int height) {
  LinearImage image{width, height,
                    std::vector<std::array<double, 4>>(index(width) * index(height), {0, 0, 0, 0})};
  const MergedScene scene = merge(surfaces);
  if (scene.triangles.empty()) return image;

  std::vector<ScreenPoint> projected;
  projected.reserve(scene.points.size());
  for (const Eigen::Vector3d& point : scene.points) {
    const ScreenPoint seen = camera.project(point);
    projected.push_back({kSamples * seen.x, kSamples * seen.y, seen.nearness});
  }
  VisibilityBuffer buffer(kSamples * width, kSamples * height);
  rasterise(projected, scene.triangles, buffer);
  const std::vector<Fragment> fragments = collect_fragments(buffer, scene, projected, width, height);

  const std::vector<Eigen::Vector3d> faces = face_normals(scene.points, scene.triangles);
  const std::vector<std::array<Eigen::Vector3d, 3>> corners = corner_normals(scene.points, scene.triangles);
  std::vector<LitPoint> lit(fragments.size());
  for (std::size_t f = 0; f < fragments.size(); ++f) {
    const std::size_t t = index(fragments[f].triangle);
    lit[f] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), faces[t]};
    for (std::size_t k = 0; k < 3; ++k) {
      lit[f].position += fragments[f].corners[k] * scene.points[index(scene.triangles[t][k])];
      lit[f].normal += fragments[f].corners[k] * corners[t][k];
    }
    lit[f].normal.normalize();
    if (lit[f].face_normal.dot(camera.eye - lit[f].position) < 0) {
      lit[f].normal = -lit[f].normal;
      lit[f].face_normal = -lit[f].face_normal;
    }
  }

  const std::vector<Lamp> lamps = studio_lamps(camera);
  const std::vector<ReceivedLight> received = receive_light(lit, lamps, scene.points, scene.triangles);
  for (std::size_t f = 0; f < fragments.size(); ++f) {
    const std::size_t t = index(fragments[f].triangle);
    double value = 0;
    for (std::size_t k = 0; k < 3; ++k)
      value += fragments[f].corners[k] * scene.values[index(scene.triangles[t][k])];
    const Colour colour = shade(surfaces[scene.surface[t]], value, lit[f], received[f], fragments[f], camera);
    std::array<double, 4>& pixel = image.pixels[fragments[f].pixel];
    for (std::size_t i = 0; i < 3; ++i) pixel[i] += fragments[f].coverage * colour[i];
    pixel[3] += fragments[f].coverage;
  }
  return image;
}

}  // namespace palpate
