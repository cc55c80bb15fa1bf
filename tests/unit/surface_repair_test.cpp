// What the mesher mends and refuses before it closes a surface, and the edge lengths that it wants.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "offline/mesh/input_error.hpp"
#include "offline/mesher/size_field.hpp"
#include "offline/mesher/surface_repair.hpp"
#include "tests/support/closed_surfaces.hpp"

namespace palpate::test {
namespace surface_repair_test {

using Remarks = std::vector<std::string>;

SurfaceTriangles unit_box() {
  return box_surface({0, 0, 0}, {1, 1, 1});
}

// By the divergence theorem: only of a closed surface that faces outward all over.
double volume_of(const SurfaceTriangles& surface) {
  double volume = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    const auto at = [&](int node) { return surface.positions[static_cast<std::size_t>(node)]; };
    volume += at(a).dot(at(b).cross(at(c))) / 6;
  }
  return volume;
}

std::string refusal(const SurfaceTriangles& surface) {
  try {
    repair_surface(surface, "organ.stl");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(SurfaceRepair, LeavesASoundSurfaceAsItIs) {
  const RepairedSurface repaired = repair_surface(unit_box(), "box.stl");
  EXPECT_EQ(repaired.remarks, Remarks{});
  EXPECT_EQ(repaired.surface.positions, unit_box().positions);
  EXPECT_EQ(repaired.surface.triangles, unit_box().triangles);
}

TEST(SurfaceRepair, WeldsTrianglesThatHaveCornersOfTheirOwn) {
  SurfaceTriangles loose;
  const SurfaceTriangles box = unit_box();
  for (const auto& triangle : box.triangles) {
    const int first = static_cast<int>(loose.positions.size());
    for (const int node : triangle) {
      const Eigen::Vector3d noise = 1e-8 * Eigen::Vector3d(first % 2, first % 5, first % 7);
      loose.positions.push_back(box.positions[static_cast<std::size_t>(node)] + noise);
    }
    loose.triangles.push_back({first, first + 1, first + 2});
  }
  const RepairedSurface repaired = repair_surface(loose, "box.stl");
  EXPECT_EQ(repaired.remarks, Remarks{"welded 28 points to others at the same place"});
  EXPECT_EQ(repaired.surface.positions.size(), 8U);
  EXPECT_NEAR(volume_of(repaired.surface), 1, 1e-6);
}

TEST(SurfaceRepair, DropsCopiesAndNeedles) {
  SurfaceTriangles box = unit_box();
  box.triangles.push_back(box.triangles[3]);
  box.triangles.push_back({box.triangles[5][2], box.triangles[5][0], box.triangles[5][1]});
  box.triangles.push_back({2, 2, 1});
  const RepairedSurface repaired = repair_surface(box, "box.stl");
  EXPECT_EQ(repaired.remarks, (Remarks{"dropped 1 triangles without an area",
                                       "dropped 2 triangles that stood there twice, or back to back"}));
  EXPECT_EQ(repaired.surface.triangles, unit_box().triangles);
}

// Two boxes side by side, each with the wall between them, are one box.
TEST(SurfaceRepair, UnitesBodiesAlongAnEqualWall) {
  const RepairedSurface repaired =
      repair_surface(both(box_surface({-1, 0, 0}, {0, 1, 1}), unit_box()), "box.stl");
  EXPECT_EQ(repaired.remarks, (Remarks{"welded 4 points to others at the same place",
                                       "dropped 4 triangles that stood there twice, or back to back"}));
  EXPECT_NEAR(volume_of(repaired.surface), 2, 1e-12);
}

// The majority decides: which way is out is known once the surface is closed.
TEST(SurfaceRepair, TurnsTrianglesAlike) {
  SurfaceTriangles box = unit_box();
  for (const std::size_t triangle : {0U, 7U, 11U})
    std::swap(box.triangles[triangle][0], box.triangles[triangle][2]);
  const RepairedSurface repaired = repair_surface(box, "box.stl");
  EXPECT_EQ(repaired.remarks, Remarks{"turned 3 triangles around, which faced the other way"});
  EXPECT_NEAR(volume_of(repaired.surface), 1, 1e-12);
}

TEST(SurfaceRepair, RefusesWhatBoundsNoSolid) {
  SurfaceTriangles square;
  square.positions = {{0, 0, 3}, {1, 0, 3}, {0, 1, 3}, {1, 1, 3}};
  square.triangles = {{0, 1, 2}, {1, 3, 2}};
  EXPECT_EQ(refusal(square), "organ.stl: is flat, all of it at z = 3; give the closed surface of a solid");

  SurfaceTriangles fin = unit_box();
  fin.positions.emplace_back(2, 2, 2);
  fin.triangles.push_back({0, 1, 8});
  EXPECT_EQ(
      refusal(fin),
      "organ.stl: 1 edges have three or more triangles, the first from (0 0 0) to (1 0 0); remove inner "
      "walls, and pull parts that touch there apart or unite them");

  SurfaceTriangles folded = unit_box();  // each triangle twice, back to back
  for (const auto& [a, b, c] : unit_box().triangles) folded.triangles.push_back({a, c, b});
  EXPECT_EQ(refusal(folded), "organ.stl: has no triangles that bound a solid; give a closed surface");

  SurfaceTriangles strip;  // a band of 5 quadrilaterals with half a turn
  for (int i = 0; i < 5; ++i) {
    const double turn = 2 * std::numbers::pi * i / 5;
    const Eigen::Vector3d out(std::cos(turn), std::sin(turn), 0);
    const Eigen::Vector3d across = std::cos(turn / 2) * Eigen::Vector3d::UnitZ() + std::sin(turn / 2) * out;
    strip.positions.push_back(3 * out + across);
    strip.positions.push_back(3 * out - across);
    const int a = 2 * i, b = 2 * i + 1, c = i < 4 ? 2 * i + 2 : 1, d = i < 4 ? 2 * i + 3 : 0;
    strip.triangles.insert(strip.triangles.end(), {{a, b, c}, {b, d, c}});
  }
  EXPECT_NE(refusal(strip).find("organ.stl: is one-sided, as a Moebius strip, near ("), std::string::npos)
      << refusal(strip);
}

MeshData box_with_sets() {
  MeshData mesh = mesh_of(unit_box());
  mesh.node_sets["PROBE"] = {7};
  mesh.element_sets["top"] = {2, 3};  // z = 1
  return mesh;
}

TEST(SizeField, GrowsFromPlacesAndWithDepth) {
  const SizeField sizes(0.5, {"0,0,0,0.25: 0.1"}, box_with_sets());
  EXPECT_DOUBLE_EQ(sizes.at_surface({0.2, 0, 0}), 0.1);
  EXPECT_DOUBLE_EQ(sizes.at_surface({0.75, 0, 0}), 0.1 + kGrowth * 0.5);
  EXPECT_DOUBLE_EQ(sizes.at_surface({9, 9, 9}), 0.5);
  EXPECT_DOUBLE_EQ(sizes.inside({0.2, 0, 0}, 0.5), 0.1 + kGrowth * 0.5);
  EXPECT_DOUBLE_EQ(sizes.inside({9, 9, 9}, 100), kCoreFactor * 0.5);
}

// The size holds within a distance of its own about the set, also in the middle of large triangles.
TEST(SizeField, KnowsSetsOfPointsAndTriangles) {
  const SizeField about_node(0.5, {" probe : 0.1"}, box_with_sets());
  EXPECT_DOUBLE_EQ(about_node.at_surface({1, 1, 0.95}), 0.1);
  EXPECT_DOUBLE_EQ(about_node.at_surface({0, 0, 0}), 0.5);
  const SizeField on_top(0.5, {"top:0.1"}, box_with_sets());
  for (const double x : {0.0, 0.31, 0.5, 0.77}) {
    for (const double y : {0.0, 0.12, 0.5, 1.0})
      EXPECT_LE(on_top.at_surface({x, y, 1}), 0.1 + 1e-12) << x << " " << y;
  }
  EXPECT_NEAR(on_top.at_surface({0.5, 0.5, 0}), 0.5, 0.05);
  EXPECT_NEAR(on_top.at_surface({0.5, 0.5, 0.5}), 0.1 + kGrowth * 0.4, 0.01);
}

TEST(SizeField, RefusesTextsThatSayNothing) {
  const auto says = [](const std::string& text) -> std::string {
    try {
      SizeField(0.5, {text}, box_with_sets());
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(says("1,2,3,4"), "--refine '1,2,3,4': has no ':'; give \"x,y,z,r: size\" or \"SET: size\"");
  EXPECT_EQ(says("1,2,3: 0.1"),
            "--refine '1,2,3: 0.1': takes four numbers before the ':', x,y,z and a radius; correct it");
  EXPECT_EQ(says("1,2,3,4: -1"), "--refine '1,2,3,4: -1': gives no size above 0 behind the ':'; correct it");
  EXPECT_EQ(says("1,2,3,4: 2"),
            "--refine '1,2,3,4: 2': is coarser than --size 0.5; places can only be finer");
  EXPECT_EQ(says("PROBES: 0.1"), "--refine 'PROBES: 0.1': is no set of the mesh; did you mean PROBE?");
  const char* const kTooFine = "takes more elements than the mesher makes; give the set a larger size";
  EXPECT_EQ(says("top: 0.001"), "--refine 'top: 0.001': " + std::string(kTooFine));  // too many points
  EXPECT_EQ(says("top: 1e-9"), "--refine 'top: 1e-9': " + std::string(kTooFine));    // too long an edge
}

// A cube of edge 100: the core below the layers, 7.75e5 large, holds 7.75e5 / (0.13 2.5^3) elements.
TEST(SizeField, EstimatesElements) {
  const MeshData mesh = box_with_sets();
  const double graded = SizeField(1, {}, mesh).num_elements(6e4, 1e6);
  EXPECT_GT(graded, 3.8e5);
  EXPECT_LT(graded, 1.2e6);
  EXPECT_GT(SizeField(1, {"0,0,0,10: 0.25"}, mesh).num_elements(6e4, 1e6), 2 * graded);
}

}  // namespace surface_repair_test
}  // namespace palpate::test
