#include "offline/output/tool_shape.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "offline/output/shading_normals.hpp"

namespace palpate {
namespace {

constexpr int kSides = 40;  // sides of round parts

// Sizes relative to the scene's radius.
constexpr double kSmallestBall = 0.03;
constexpr double kArrowLength = 0.32;
constexpr double kShaftRadius = 0.017;
constexpr double kHeadRadius = 0.048;
constexpr double kHeadLength = 0.115;
constexpr double kArrowGap = 0.02;  // between ball and arrow

// Returns the outward unit normal at the node of a triangle nearest to `position`.
Eigen::Vector3d outward_normal_near(const Eigen::Vector3d& position, std::span<const Eigen::Vector3d> points,
                                    std::span<const std::array<int, 3>> triangles) {
  const std::vector<Eigen::Vector3d> faces = face_normals(points, triangles);
  double nearest = std::numeric_limits<double>::infinity();
  int node = -1;
  for (const std::array<int, 3>& triangle : triangles) {
    for (const int corner : triangle) {
      const double distance = (points[static_cast<std::size_t>(corner)] - position).norm();
      if (distance < nearest) {
        nearest = distance;
        node = corner;
      }
    }
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (std::find(triangles[t].begin(), triangles[t].end(), node) != triangles[t].end()) sum += faces[t];
  return sum.norm() > 0 ? Eigen::Vector3d(sum.normalized()) : Eigen::Vector3d::UnitZ();
}

// A point of the profile of a solid of revolution.
struct ProfilePoint {
  double along = 0;   // position along the axis, length unit
  double radius = 0;  // distance from the axis, length unit
};

// Adds the solid of revolution of a profile about the axis through `origin`. The profile runs against the
// axis, from the tip backwards; triangles then face outwards.
void add_revolved(LitSurface& surface, const Eigen::Vector3d& origin, const Eigen::Vector3d& axis,
                  std::span<const ProfilePoint> profile) {
  const Eigen::Vector3d first = perpendicular_to(axis);
  const Eigen::Vector3d second = axis.cross(first);
  const int start = static_cast<int>(surface.points.size());
  for (const ProfilePoint& point : profile) {
    for (int side = 0; side < kSides; ++side) {
      const double angle = 2.0 * std::numbers::pi * side / kSides;
      surface.points.push_back(origin + point.along * axis +
                               point.radius * (std::cos(angle) * first + std::sin(angle) * second));
    }
  }
  for (int ring = 0; ring + 1 < static_cast<int>(profile.size()); ++ring) {
    for (int side = 0; side < kSides; ++side) {
      const int here = start + ring * kSides + side;
      const int beside = start + ring * kSides + (side + 1) % kSides;
      surface.triangles.push_back({here, here + kSides, beside});
      surface.triangles.push_back({beside, here + kSides, beside + kSides});
    }
  }
}

}  // namespace

PlacedTool place_tool(const Eigen::Vector3d& position, const Eigen::Vector3d& displacement, double radius,
                      std::span<const Eigen::Vector3d> rest, std::span<const std::array<int, 3>> triangles,
                      double scale) {
  PlacedTool tool;
  const Eigen::Vector3d normal = outward_normal_near(position, rest, triangles);
  tool.contact = position + displacement;
  tool.direction = displacement.stableNormalized();
  tool.outward = normal;
  if (tool.direction.norm() > 0)
    tool.outward = tool.direction.dot(normal) > 0 ? tool.direction : Eigen::Vector3d(-tool.direction);
  tool.ball_radius = std::max(radius, kSmallestBall * scale);
  tool.ball_centre = tool.contact + tool.ball_radius * tool.outward;
  tool.arrow_length = kArrowLength * scale;
  return tool;
}

LitSurface tool_surface(const PlacedTool& tool, const Colour& colour) {
  LitSurface surface;
  std::vector<ProfilePoint> ball;
  for (int ring = 0; ring <= kSides / 2; ++ring) {
    const double angle = 2.0 * std::numbers::pi * ring / kSides;
    ball.push_back({tool.ball_radius * std::cos(angle), tool.ball_radius * std::sin(angle)});
  }
  add_revolved(surface, tool.ball_centre, tool.outward, ball);

  if (tool.direction.norm() > 0) {
    const double scale = tool.arrow_length / kArrowLength;
    const double length = tool.arrow_length;
    const double nearer_end = tool.ball_radius + kArrowGap * scale;
    const bool push = tool.direction.dot(tool.outward) < 0;
    const Eigen::Vector3d tip = tool.ball_centre + (push ? nearer_end : nearer_end + length) * tool.outward;
    const std::array<ProfilePoint, 5> arrow = {{{0, 0},
                                                {-kHeadLength * scale, kHeadRadius * scale},
                                                {-kHeadLength * scale, kShaftRadius * scale},
                                                {-length, kShaftRadius * scale},
                                                {-length, 0}}};
    add_revolved(surface, tip, tool.direction, arrow);
  }
  surface.values.assign(surface.points.size(), 0.0);
  surface.colour = [colour](double) { return colour; };
  surface.gloss = 0.35;
  return surface;
}

}  // namespace palpate
