#include "offline/output/lighting.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "offline/output/camera.hpp"
#include "offline/output/rasteriser.hpp"

namespace palpate {
namespace {

// Lamps. More lamps make softer shadows; the time grows with their number.
constexpr int kSkyLamps = 96;
constexpr int kKeyLamps = 20;
constexpr int kRimLamps = 6;
constexpr double kExposure = 1.12;  // light on the reference surface of studio_lamps()
constexpr double kLeak = 0.08;      // fraction of sky and rim light in shadows, for scattered light
constexpr double kSkyLight = 2.9;   // light of all sky lamps, where all key lamps have 1
constexpr int kShadowSize = 384;    // samples along each side of a lamp's depth image

const double kGoldenAngle = std::numbers::pi * (3.0 - std::sqrt(5.0));

// Adds `count` lamps, spread evenly over a disc of the sky around `centre`, with `light` in total.
void add_bunch(std::vector<Lamp>& lamps, const Eigen::Vector3d& centre, double radius_radians, int count,
               const Colour& light, bool is_key) {
  const Eigen::Vector3d first = perpendicular_to(centre);
  const Eigen::Vector3d second = centre.cross(first);
  for (int i = 0; i < count; ++i) {
    // The square root gives each lamp the same share of the disc.
    const double radius = std::tan(radius_radians) * std::sqrt((i + 0.5) / count);
    const double angle = i * kGoldenAngle;
    const Eigen::Vector3d towards = centre + radius * (std::cos(angle) * first + std::sin(angle) * second);
    lamps.push_back({towards.normalized(), {light[0] / count, light[1] / count, light[2] / count}, is_key});
  }
}

// The depth image of one lamp: parallel projection on a square around the bounding sphere.
class ShadowImage {
 public:
  ShadowImage() : buffer_(kShadowSize, kShadowSize) {}

  void draw(const Eigen::Vector3d& towards, const Eigen::Vector3d& centre, double radius,
            std::span<const Eigen::Vector3d> points, std::span<const std::array<int, 3>> triangles) {
    towards_ = towards;
    across_ = perpendicular_to(towards);
    along_ = towards.cross(across_);
    centre_ = centre;
    samples_per_length_ = 0.5 * (kShadowSize - 4) / radius;  // two samples stay free at each edge
    projected_.clear();
    for (const Eigen::Vector3d& point : points) projected_.push_back(project(point));
    buffer_.clear();
    rasterise(projected_, triangles, buffer_);
  }

  // Returns the fraction of the lamp that the point sees, the bilinear mean of the samples around the point.
  double visibility(const Eigen::Vector3d& point) const {
    const ScreenPoint seen = project(point);
    // The right and lower neighbours must lie inside the image.
    const double x = std::clamp(seen.x - 0.5, 0.0, kShadowSize - 1.001);
    const double y = std::clamp(seen.y - 0.5, 0.0, kShadowSize - 1.001);
    const int left = static_cast<int>(x);
    const int top = static_cast<int>(y);
    const auto lit = [&](int column, int row) {
      return static_cast<double>(buffer_.nearness[buffer_.at(column, row)]) <= seen.nearness ? 1.0 : 0.0;
    };
    const double upper = std::lerp(lit(left, top), lit(left + 1, top), x - left);
    const double lower = std::lerp(lit(left, top + 1), lit(left + 1, top + 1), x - left);
    return std::lerp(upper, lower, y - top);
  }

 private:
  ScreenPoint project(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d from_centre = point - centre_;
    return {0.5 * kShadowSize + samples_per_length_ * from_centre.dot(across_),
            0.5 * kShadowSize + samples_per_length_ * from_centre.dot(along_), from_centre.dot(towards_)};
  }

  Eigen::Vector3d towards_, across_, along_, centre_;
  double samples_per_length_ = 1;
  std::vector<ScreenPoint> projected_;
  VisibilityBuffer buffer_;
};

}  // namespace

Eigen::Vector3d key_direction(const Camera& camera) {
  return (-0.74 * camera.right + 0.54 * camera.up - 0.42 * camera.forward).normalized();
}

std::vector<Lamp> studio_lamps(const Camera& camera) {
  std::vector<Lamp> lamps;
  for (int i = 0; i < kSkyLamps; ++i) {
    const double height = 1.0 - 2.0 * (i + 0.5) / kSkyLamps;
    const double ring = std::sqrt(1.0 - height * height);
    const Eigen::Vector3d towards = ring * std::cos(i * kGoldenAngle) * camera.right + height * camera.up +
                                    ring * std::sin(i * kGoldenAngle) * camera.forward;
    // Lamps are brighter above and near the viewer, cool above and warm below, like an open sky.
    const double strength = 0.55 + 0.30 * height + 0.45 * std::max(0.0, -towards.dot(camera.forward));
    const double cool = 0.05 * height;
    const double share = kSkyLight / kSkyLamps;
    lamps.push_back(
        {towards, {share * strength * (1 - cool), share * strength, share * strength * (1 + cool)}, false});
  }
  add_bunch(lamps, key_direction(camera), 0.26, kKeyLamps, {1.04, 1.0, 0.95}, true);
  add_bunch(lamps, (0.8 * camera.right + 0.35 * camera.up + 0.5 * camera.forward).normalized(), 0.2,
            kRimLamps, {0.42, 0.46, 0.52}, false);

  // The reference surface faces between key and viewer. Without shadows the surface gets kExposure of green.
  const Eigen::Vector3d reference = (key_direction(camera) - camera.forward).normalized();
  double received = 0;
  for (const Lamp& lamp : lamps) received += lamp.light[1] * std::max(0.0, lamp.towards.dot(reference));
  for (Lamp& lamp : lamps)
    for (double& channel : lamp.light) channel *= kExposure / received;
  return lamps;
}

std::vector<ReceivedLight> receive_light(std::span<const LitPoint> lit, std::span<const Lamp> lamps,
                                         std::span<const Eigen::Vector3d> points,
                                         std::span<const std::array<int, 3>> triangles) {
  std::vector<ReceivedLight> received(lit.size());
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points) box.extend(point);
  const double radius = scene_radius(points);
  // Points are tested a few samples above their surface. Rounding of the depth image then casts no shadow.
  constexpr double kLiftSamples = 3;
  const double lift = kLiftSamples * 2.0 * radius / kShadowSize;

  ShadowImage shadow;
  const auto num_keys = static_cast<double>(
      std::count_if(lamps.begin(), lamps.end(), [](const Lamp& lamp) { return lamp.is_key; }));
  for (const Lamp& lamp : lamps) {
    shadow.draw(lamp.towards, box.center(), radius, points, triangles);
    for (std::size_t i = 0; i < lit.size(); ++i) {
      const double cosine = lit[i].normal.dot(lamp.towards);
      if (cosine <= 0) continue;
      const double visibility = shadow.visibility(lit[i].position + lift * lit[i].face_normal);
      const double seen = lamp.is_key ? visibility : kLeak + (1.0 - kLeak) * visibility;
      for (std::size_t channel = 0; channel < 3; ++channel)
        received[i].diffuse[channel] += lamp.light[channel] * cosine * seen;
      if (lamp.is_key) received[i].key_visibility += visibility / num_keys;
    }
  }
  return received;
}

}  // namespace palpate
