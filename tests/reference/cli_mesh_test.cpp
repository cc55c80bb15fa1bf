// `palpate mesh`: a closed surface becomes tetrahedra, and a pack by three commands.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <regex>

#include "offline/io/mesh_formats.hpp"
#include "tests/support/closed_surfaces.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/shell_command.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {
namespace cli_mesh_test {

const std::filesystem::path kProgram = PALPATE_PROGRAM;

class Mesher : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kProgram.parent_path() / "palpate_mesher"))
      GTEST_SKIP() << "palpate_mesher was not built: PALPATE_MESHER is off, or libcgal-dev is absent";
  }

  std::string path(const std::string& name) const { return (dir_.path() / name).string(); }

  std::string surface_file(const SurfaceTriangles& surface) const {
    write_mesh(mesh_of(surface), {}, path("surface.ply"));
    return path("surface.ply");
  }

  // Runs `palpate mesh` on the surface, and returns what `palpate check` says of the result.
  nlohmann::json filled(const SurfaceTriangles& surface, const std::string& size,
                        const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"mesh", surface_file(surface), "--size", size, "-o", path("solid.vtu")};
    words.insert(words.end(), more.begin(), more.end());
    run_ = run_cleanly(words);
    return run_cleanly({"check", path("solid.vtu"), "--json"}).json();
  }

  std::string refusal(const SurfaceTriangles& surface, const std::string& size) const {
    return dir_.without_folder(
        refusal_of({"mesh", surface_file(surface), "--size", size, "-o", path("solid.vtu")}));
  }

  TempDir dir_;
  ProgramRun run_;
};

constexpr double kLeastAngle = 8;                        // degrees between faces
const double kBall = 4.0 / 3 * std::numbers::pi * 1000;  // volume of radius 10

TEST_F(Mesher, FillsASphere) {
  const nlohmann::json check = filled(sphere_surface(10, 4), "1");
  EXPECT_NEAR(check["volume"].get<double>(), kBall, 0.01 * kBall);
  EXPECT_EQ(check["parts"].size(), 1u);
  EXPECT_EQ(check["open_edges"], 0);
  EXPECT_GT(check["least_angle"].get<double>(), kLeastAngle);
  EXPECT_NEAR(check["mean_surface_edge"].get<double>(), 1, 0.15);
  // Elements grow inward: as many regular tetrahedra of edge 1 would not fill half of the ball.
  EXPECT_LT(check["elements"].get<double>() / (6 * std::sqrt(2)), 0.5 * kBall);
  EXPECT_NE(run_.out.find("\nNext:\n  palpate new " + path("solid.vtu")), std::string::npos) << run_.out;
}

TEST_F(Mesher, GivesEqualBytesEachTime) {
  filled(sphere_surface(10, 2), "3");
  const std::string first = file_text(path("solid.vtu"));
  run_cleanly({"mesh", path("surface.ply"), "--size", "3", "-o", path("again.VTU")});
  EXPECT_EQ(file_text(path("again.VTU")), first);
}

// Chords cut a part of the volume off, which grows with the edges.
TEST_F(Mesher, WarnsOfLostVolume) {
  filled(sphere_surface(10, 4), "9");
  std::smatch found;
  ASSERT_TRUE(std::regex_search(
      run_.out, found, std::regex("warning    the volume differs by ([0-9.]+) %.*take --size ([0-9.]+)")))
      << run_.out;
  const std::string remedy = found[2];
  const nlohmann::json check = filled(sphere_surface(10, 4), remedy);
  EXPECT_NEAR(check["volume"].get<double>(), kBall, 0.02 * kBall);
  EXPECT_EQ(run_.out.find("warning"), std::string::npos) << run_.out;
}

// Volumes do not lose their digits far from the origin.
TEST_F(Mesher, FillsABoxFarAway) {
  const Eigen::Vector3d far = {1e9, 1e9, 1e9};
  filled(box_surface(far, far + Eigen::Vector3d(1, 2, 3)), "0.5");
  EXPECT_NE(run_.out.find("solid      1 part, volume 6\n"), std::string::npos) << run_.out;
}

TEST_F(Mesher, KeepsCavitiesAndParts) {
  const SurfaceTriangles hollow = both(sphere_surface(10, 4), sphere_surface(5, 3));
  const nlohmann::json check = filled(both(hollow, sphere_surface(2, 2, {30, 0, 0})), "1");
  EXPECT_NE(run_.out.find("\nsolid      2 parts with 1 cavity,"), std::string::npos) << run_.out;
  EXPECT_EQ(check["parts"].size(), 2u);
  // The inputs are polyhedra of 5,120, 1,280 and 320 triangles: 0.3 to 4 % below the spheres.
  const double exact = kBall * (1 - 0.125 + 0.008);
  EXPECT_NEAR(check["volume"].get<double>(), exact, 0.015 * exact);
  EXPECT_GT(check["least_angle"].get<double>(), kLeastAngle);
}

TEST_F(Mesher, FollowsSharpEdges) {
  const nlohmann::json check = filled(box_surface({0, 0, 0}, {10, 20, 30}), "3");
  EXPECT_NEAR(check["volume"].get<double>(), 6000, 1e-6);
  EXPECT_NE(run_.out.find("follows sharp edges of length 240"), std::string::npos) << run_.out;
  EXPECT_GT(check["least_angle"].get<double>(), kLeastAngle);
}

TEST_F(Mesher, RefinesPlaces) {
  const SurfaceTriangles sphere = sphere_surface(10, 4);
  filled(sphere, "3", {"--refine", "10,0,0,2: 0.8", "--refine", "-10,0,0,0: 1"});
  const SurfaceTriangles outer = surface_triangles(read_mesh(path("solid.vtu")), "solid.vtu");
  // The mean edge of surface triangles near a place.
  const auto mean_edge = [&](const Eigen::Vector3d& place, double radius) {
    double sum = 0;
    int count = 0;
    for (const auto& [a, b, c] : outer.triangles) {
      const auto at = [&](int node) { return outer.positions[static_cast<std::size_t>(node)]; };
      if (((at(a) + at(b) + at(c)) / 3 - place).norm() > radius) continue;
      sum += (at(a) - at(b)).norm() + (at(b) - at(c)).norm() + (at(c) - at(a)).norm();
      count += 3;
    }
    return sum / count;
  };
  EXPECT_NEAR(mean_edge({10, 0, 0}, 2), 0.8, 0.2);
  EXPECT_NEAR(mean_edge({0, 10, 0}, 4), 3, 0.6);
}

TEST_F(Mesher, ClosesSmallHoles) {
  SurfaceTriangles pierced = sphere_surface(10, 3);
  pierced.triangles.erase(pierced.triangles.begin());
  const nlohmann::json check = filled(pierced, "1");
  EXPECT_TRUE(std::regex_search(run_.out, std::regex("\nmended     closed 1 holes, the largest with 3 edges, "
                                                     "[0-9.]+ around, about \\(")))
      << run_.out;
  EXPECT_NEAR(check["volume"].get<double>(), kBall, 0.025 * kBall);
}

TEST_F(Mesher, RefusesWhatBoundsNoSolid) {
  SurfaceTriangles bowl = sphere_surface(10, 3);
  std::erase_if(bowl.triangles, [&](const std::array<int, 3>& triangle) {
    return bowl.positions[static_cast<std::size_t>(triangle[0])][2] > 3;
  });
  EXPECT_TRUE(refusal(bowl, "2").starts_with("surface.ply: is open: 1 holes, the largest with"))
      << refusal(bowl, "2");

  const SurfaceTriangles crossing = both(sphere_surface(10, 2), sphere_surface(10, 2, {8, 1, 2}));
  const std::string message = refusal(crossing, "2");
  EXPECT_TRUE(
      std::regex_search(message, std::regex("^surface.ply: [0-9]+ pairs of triangles cross or touch, the "
                                            "first \\(.*\\) with \\(.*\\); mend the surface")))
      << message;

  const SurfaceTriangles leaf = box_surface({0, 0, 0}, {10, 10, 0.01});
  EXPECT_EQ(refusal(leaf, "2").substr(0, 58), "surface.ply: is about 0.00998 thick, too thin for --size 2");
  EXPECT_NE(refusal(box_surface({0, 0, 0}, {10, 10, 0}), "2").find("is flat, all of it at z = 0"),
            std::string::npos);

  // Powers of such lengths leave the range of a double.
  for (const double length : {1e30, 1e-100})
    EXPECT_NE(refusal(box_surface({0, 0, 0}, {length, length, length}), "1").find("; scale it, since"),
              std::string::npos);
  // All triangles lie on a line, which no axis follows.
  EXPECT_NE(refusal({{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}}, {{0, 1, 2}, {1, 3, 2}}}, "1")
                .find("has no triangles with an area"),
            std::string::npos);
  dir_.write("empty.obj", "v 0 0 0\n");
  EXPECT_NE(refusal_of({"mesh", path("empty.obj"), "--size", "1", "-o", path("a.vtu")}).find("has no faces"),
            std::string::npos);
}

TEST_F(Mesher, RefusesArgumentsWithARemedy) {
  const std::string file = surface_file(sphere_surface(10, 2));
  const auto says = [&](const std::vector<std::string>& arguments, const char* words) {
    std::vector<std::string> all = {"mesh", file};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const std::string message = refusal_of(all);
    EXPECT_NE(message.find(words), std::string::npos) << message;
  };
  says({"-o", path("a.vtu")}, "--size is needed");
  says({"-o", path("a.vtu")}, "so try --size 0.8");
  says({"--size", "-1", "-o", path("a.vtu")}, "--size is needed, a number above 0");
  says({"--size", "2"}, "--output is required");
  says({"--size", "2", "-o", path("a.stl")}, "no tetrahedra are written with this ending");
  says({"--size", "2", "-o", path("none/a.vtu")}, "its folder does not exist");
  says({"--size", "2", "-o", file}, "is an input of this command");
  says({"--size", "0.02", "-o", path("a.vtu")}, "tetrahedra, more than 4e+06; take 0.");
  says({"--size", "1e-150", "-o", path("a.vtu")}, "tetrahedra, more than 4e+06; take 0.");
  says({"--size", "2", "-o", path("a.vtu"), "--refine", "10,0,0,1: 0.002"}, "--refine adds about ");
  says({"--size", "2", "-o", path("a.vtu"), "--refine", "PROBE: 1"}, "is no set of the mesh");
}

TEST_F(Mesher, MakesAPackInThreeCommands) {
  write_mesh(mesh_of(sphere_surface(10, 3)), {}, path("organ.stl"));
  run_cleanly({"mesh", path("organ.stl"), "--size", "4", "-o", path("organ.vtu")});
  run_cleanly({"new", path("organ.vtu"), "-o", path("made"), "--probe", "z>80%"});
  run_cleanly({"build", path("made/organ.toml"), "-o", path("organ.pack"), "--survey", "none"});
  run_cleanly({"verify", path("organ.pack")});
}

// Where the mesher was not built, the command says how to get it.
TEST(WithoutMesher, SaysHowToGetIt) {
  const TempDir dir;
  const std::filesystem::path alone = dir.path() / "palpate";
  std::filesystem::copy_file(kProgram, alone);
  const CommandResult run = run_command(shell_word(alone.string()) + " mesh organ.stl --size 3 -o organ.vtu");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_EQ(
      dir.without_folder(run.output),
      "palpate mesh: cannot run palpate_mesher (No such file or directory); install libcgal-dev, and build "
      "again with PALPATE_MESHER=ON\n");
  dir.write("palpate_mesher", "");  // which may not be executed
  EXPECT_EQ(dir.without_folder(
                run_command(shell_word(alone.string()) + " mesh organ.stl --size 3 -o organ.vtu").output),
            "palpate mesh: cannot run palpate_mesher (Permission denied)\n");
}

}  // namespace cli_mesh_test
}  // namespace palpate::test
