// The size of an organ beside its unit, reach and tip.
#include "offline/pipeline/organ_size.hpp"

#include <gtest/gtest.h>

#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace organ_size_test {

constexpr double kEdge = 10;

struct OrganSize : ::testing::Test {
  OrganSize() {
    test::BlockShape shape;
    shape.size = {160, 140, 120};
    model = test::tetrahedral_block(shape);
    model.file = "liver.inp";
    scene.file = "liver.toml";
    scene.length_unit = "mm";
    scene.metres_per_length_unit = 1e-3;
    scene.max_displacement = 8;
  }
  Scene scene;
  Model model;
};

TEST_F(OrganSize, IsSaidWithUnitAndReach) {
  model.positions.emplace_back(1e6, 0, 0);  // belongs to no element
  EXPECT_EQ(size_text(scene, model, kEdge), "organ 160 x 140 x 120 mm; |d| to 8 mm: 0.80 h, 5 % of it");
  scene.length_unit = "";
  EXPECT_EQ(size_text(scene, model, kEdge), "organ 160 x 140 x 120; |d| to 8: 0.80 h, 5 % of it");
  EXPECT_TRUE(size_warnings(scene, model, kEdge).empty());
}

TEST_F(OrganSize, APlausibleOneIsNotWarnedOf) {
  EXPECT_TRUE(size_warnings(scene, model, kEdge).empty());
  scene.max_displacement = 160;
  EXPECT_TRUE(size_warnings(scene, model, kEdge).empty());
}

TEST_F(OrganSize, ItsUnitIsDoubted) {
  scene.metres_per_length_unit = 1;
  scene.length_unit = "m";
  EXPECT_EQ(
      size_warnings(scene, model, kEdge),
      (std::vector<std::string>{"liver.toml: the organ is 160 x 140 x 120 m, above 2 m; correct [units] "
                                "length, if liver.inp has its numbers in mm"}));
  for (Eigen::Vector3d& position : model.positions) position *= 1e-3;
  scene.max_displacement *= 1e-3;
  EXPECT_TRUE(size_warnings(scene, model, kEdge).empty());
  scene.metres_per_length_unit = 1e-3;
  scene.length_unit = "mm";
  EXPECT_EQ(size_warnings(scene, model, kEdge),
            (std::vector<std::string>{"liver.toml: the organ is 0.16 x 0.14 x 0.12 mm, below 1 mm; correct "
                                      "[units] length, if liver.inp has its numbers in m"}));
}

TEST_F(OrganSize, AReachBeyondItIsWarnedOf) {
  scene.max_displacement = 320;
  EXPECT_EQ(
      size_warnings(scene, model, kEdge),
      (std::vector<std::string>{"liver.toml: max_displacement = 320 mm is 32 mean edges and 2 times the "
                                "organ: the organ is 160 x 140 x 120 mm; state it in the unit of "
                                "liver.inp"}));
}

TEST_F(OrganSize, ATipIsBelowAnEdge) {
  EXPECT_TRUE(is_tip_below_edge(0, kEdge));
  EXPECT_TRUE(is_tip_below_edge(9.99, kEdge));
  EXPECT_FALSE(is_tip_below_edge(kEdge, kEdge));
  EXPECT_EQ(
      tip_text(0.3, 2.276, " mm"),
      "the tip (tip_radius = 0.3 mm) is smaller than an edge (h = 2.276 mm): the force is a property of "
      "the mesh");
}

}  // namespace organ_size_test
}  // namespace palpate
