// The picture of a touched organ, pixel by pixel. The dent changes one panel and not the other, and no
// degenerate input breaks the drawing.
#include "offline/output/organ_picture.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <numbers>

#include "offline/output/camera.hpp"
#include "offline/output/colour_map.hpp"
#include "offline/output/renderer.hpp"
#include "offline/output/shading_normals.hpp"

namespace palpate {
namespace picture_test {

// A ball of radius 50 about `centre`, pushed 9 down at its top.
PictureInput dented_ball(const Eigen::Vector3d& centre) {
  constexpr int kRings = 24, kSides = 36;
  PictureInput input;
  for (int ring = 0; ring <= kRings; ++ring) {
    for (int side = 0; side < kSides; ++side) {
      const double polar = std::numbers::pi * ring / kRings;
      const double around = 2.0 * std::numbers::pi * side / kSides;
      const Eigen::Vector3d offset =
          50.0 * Eigen::Vector3d(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                                 std::cos(polar));
      input.rest.push_back(centre + offset);
      input.displacement.push_back(
          {0, 0, -9.0 * std::exp(-(offset - Eigen::Vector3d(0, 0, 50)).squaredNorm() / 400.0)});
      const int here = ring * kSides + side, beside = ring * kSides + (side + 1) % kSides;
      if (ring == kRings) continue;
      input.triangles.push_back({here, here + kSides, beside});
      input.triangles.push_back({beside, here + kSides, beside + kSides});
    }
  }
  input.tools.push_back({centre + Eigen::Vector3d(0, 0, 50), {0, 0, -9}, 4});
  input.length_unit = "mm";
  return input;
}

PictureOptions small_page() {
  PictureOptions options;
  options.width = 400;
  options.height = 200;
  return options;
}

const std::array<std::uint8_t, 3>& pixel(const PixelImage& image, int x, int y) {
  return image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                      static_cast<std::size_t>(x)];
}

bool is_white(const std::array<std::uint8_t, 3>& colour) {
  return colour == std::array<std::uint8_t, 3>{255, 255, 255};
}

// Pixels of the columns [left, right) for which `wanted` holds.
template <typename Wanted>
int count_pixels(const PixelImage& image, int left, int right, Wanted wanted) {
  int count = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = left; x < right; ++x) count += wanted(pixel(image, x, y)) ? 1 : 0;
  return count;
}

bool is_yellow_or_green(const std::array<std::uint8_t, 3>& c) {
  return c[1] > 90 && c[1] > c[2] + 30;
}
bool is_blue(const std::array<std::uint8_t, 3>& c) {
  return c[2] > c[0] + 25 && c[2] > c[1] + 10;
}
bool is_pink(const std::array<std::uint8_t, 3>& c) {
  return c[0] > c[1] + 20 && c[0] > 90 && c[0] < c[1] + 110;
}
bool is_red(const std::array<std::uint8_t, 3>& c) {
  return c[0] > 90 && c[0] > 2 * c[1] && c[0] > 2 * c[2];
}

// On a page of 400 pixels the panels are columns 8 to 174 and 174 to 341; the colour bar is right of them.
constexpr int kLeft = 8, kMiddle = 174, kRight = 341;

TEST(Picture, PanelsShowRestAndDent) {
  const PixelImage image = draw_before_after(dented_ball({0, 0, 0}), small_page());
  ASSERT_EQ(image.width, 400);
  ASSERT_EQ(image.height, 200);
  ASSERT_EQ(image.pixels.size(), 400U * 200U);
  EXPECT_GT(count_pixels(image, kLeft, kMiddle, is_pink), 4000);
  EXPECT_EQ(count_pixels(image, kLeft, kMiddle, is_blue), 0);
  EXPECT_EQ(count_pixels(image, kLeft, kMiddle, is_red), 0) << "the tool belongs to the pushed panel";
  EXPECT_GT(count_pixels(image, kMiddle, kRight, is_blue), 3000);
  EXPECT_GT(count_pixels(image, kMiddle, kRight, is_yellow_or_green), 60);
  EXPECT_GT(count_pixels(image, kMiddle, kRight, is_red), 60);
  EXPECT_GT(count_pixels(image, kRight, 400, is_yellow_or_green), 100) << "colour bar";
}

TEST(Picture, BackgroundIsUntouched) {
  const PixelImage image = draw_before_after(dented_ball({0, 0, 0}), small_page());
  for (const auto& [x, y] :
       {std::array{0, 0}, std::array{399, 0}, std::array{0, 199}, std::array{399, 199},
        std::array{kLeft + 3, 12}, std::array{kMiddle + 3, 12}, std::array{kMiddle, 170}})
    EXPECT_TRUE(is_white(pixel(image, x, y))) << x << ", " << y;
}

TEST(Picture, SameInputGivesSameBytes) {
  const std::filesystem::path first = std::filesystem::path(testing::TempDir()) / "picture_first.png";
  const std::filesystem::path second = std::filesystem::path(testing::TempDir()) / "picture_second.png";
  PictureInput input = dented_ball({0, 0, 0});
  input.title = "A ball";
  input.caption = "Radius 50, pushed 9";
  write_before_after(input, small_page(), first);
  write_before_after(input, small_page(), second);
  const auto bytes = [](const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  ASSERT_GT(bytes(first).size(), 1000U);
  EXPECT_EQ(bytes(first).substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(bytes(first), bytes(second));
  std::filesystem::remove(first);
  std::filesystem::remove(second);
}

// A shift of the scene changes pixels only by rounding: a few edge samples fall to the other side.
TEST(Picture, FarFromTheOriginLooksTheSame) {
  const PixelImage near = draw_before_after(dented_ball({0, 0, 0}), small_page());
  const PixelImage far = draw_before_after(dented_ball({3e6, -2e6, 5e6}), small_page());
  int different = 0;
  for (std::size_t i = 0; i < near.pixels.size(); ++i)
    for (std::size_t part = 0; part < 3; ++part)
      different += std::abs(near.pixels[i][part] - far.pixels[i][part]) > 24 ? 1 : 0;
  EXPECT_LT(different, 60);
}

// A large tool tip right behind the ball shines through: the middle of the pushed panel is redder than a
// point half way out, where only the organ is seen.
TEST(Picture, ToolBehindTheOrganShinesThrough) {
  PictureInput input = dented_ball({0, 0, 0});
  for (Eigen::Vector3d& displacement : input.displacement) displacement.setZero();
  input.tools = {{{0, 0, 50}, {0, 0, 0}, 16}};
  PictureOptions from_below = small_page();
  from_below.view_direction = Eigen::Vector3d(0, 0, 1);
  from_below.up = {0, 1, 0};
  const PixelImage image = draw_before_after(input, from_below);
  const auto redness = [&](int x, int y) { return pixel(image, x, y)[0] - pixel(image, x, y)[2]; };
  const int middle = (kMiddle + kRight) / 2;
  EXPECT_GT(redness(middle, 94), redness(middle + 40, 94) + 40);
  EXPECT_TRUE(is_blue(pixel(image, middle + 40, 94)));
}

TEST(Picture, DegenerateInputIsDrawnAsFarAsItGoes) {
  EXPECT_NO_THROW(draw_before_after({}, small_page()));

  PictureInput still = dented_ball({0, 0, 0});
  for (Eigen::Vector3d& displacement : still.displacement) displacement.setZero();
  still.tools[0].displacement.setZero();
  const PixelImage image = draw_before_after(still, small_page());
  EXPECT_EQ(count_pixels(image, kMiddle, kRight, is_yellow_or_green), 0);
  EXPECT_GT(count_pixels(image, kMiddle, kRight, is_blue), 3000);

  PictureInput one = {
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 0.1}, {0, 0, 0}, {0, 0, 0}}, {{0, 1, 2}}, {}, "", "", ""};
  EXPECT_GT(count_pixels(draw_before_after(one, small_page()), kLeft, kMiddle, is_pink), 200);
  one.tools = {{{0, 0, 0}, {0, 0, 0.1}, 0}};
  EXPECT_NO_THROW(draw_before_after(one, small_page()));

  PictureInput point = one;
  for (Eigen::Vector3d& node : point.rest) node = {7, 7, 7};
  for (Eigen::Vector3d& displacement : point.displacement) displacement.setZero();
  EXPECT_NO_THROW(draw_before_after(point, small_page()));

  for (const double size : {1e-300, 1e-12, 1e12, 1e90}) {
    PictureInput scaled = dented_ball({0, 0, 0});
    for (Eigen::Vector3d& node : scaled.rest) node *= size;
    for (Eigen::Vector3d& displacement : scaled.displacement) displacement *= size;
    EXPECT_NO_THROW(draw_before_after(scaled, small_page())) << size;
  }

  PictureOptions parallel = small_page();
  parallel.view_direction = Eigen::Vector3d(0, 0, -1);
  EXPECT_NO_THROW(draw_before_after(dented_ball({0, 0, 0}), parallel));
}

std::string refusal(const PictureInput& input, const PictureOptions& options = small_page()) {
  try {
    draw_before_after(input, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Picture, UnusableInputIsRefusedByName) {
  PictureInput input = dented_ball({0, 0, 0});
  input.displacement[17].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal(input), "the displacement of node 17 is not finite");
  input = dented_ball({0, 0, 0});
  input.rest[3].x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusal(input), "the rest position of node 3 is not finite");
  input = dented_ball({0, 0, 0});
  input.triangles[5][1] = 100000;
  EXPECT_EQ(refusal(input), "triangle 5 names node 100000 of 900");
  input = dented_ball({0, 0, 0});
  input.displacement.pop_back();
  EXPECT_EQ(refusal(input), "900 nodes at rest, but 899 displacements");
  PictureOptions options = small_page();
  options.width = 20;
  EXPECT_NE(refusal(dented_ball({0, 0, 0}), options), "");
  options = small_page();
  options.up.setZero();
  EXPECT_NE(refusal(dented_ball({0, 0, 0}), options), "");
}

TEST(Picture, FileThatCannotBeWrittenIsNamed) {
  try {
    write_before_after({}, small_page(), "/no/such/folder/organ.png");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()),
              "/no/such/folder/organ.png: cannot be written (No such file or directory); name another place");
  }
}

TEST(Picture, LongTextStaysOnThePage) {
  PictureInput input = dented_ball({0, 0, 0});
  for (int i = 0; i < 40; ++i) input.title += "viel zu lang \u00b5 ";
  const PixelImage image = draw_before_after(input, small_page());
  for (int y = 0; y < 20; ++y) EXPECT_TRUE(is_white(pixel(image, 397, y)));
}

TEST(ColourMap, EndsAndOrder) {
  EXPECT_NEAR(viridis(0)[2], 0.3294, 1e-9);
  EXPECT_NEAR(viridis(1)[0], 0.9932, 1e-9);
  EXPECT_EQ(viridis(-3), viridis(0));
  EXPECT_EQ(viridis(3), viridis(1));
  double last = -1;  // luminance rises monotonically: the map can be read in grey
  for (int i = 0; i <= 100; ++i) {
    const Colour linear = to_linear(viridis(i / 100.0));
    const double luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
    EXPECT_GT(luminance, last);
    last = luminance;
    const Colour back = to_encoded(linear);
    for (std::size_t part = 0; part < 3; ++part) EXPECT_NEAR(back[part], viridis(i / 100.0)[part], 1e-12);
  }
}

TEST(Camera, FitsAndKeepsUpUp) {
  const std::vector<Eigen::Vector3d> box = {
      {10, 20, 30}, {14, 20, 30}, {10, 26, 30}, {10, 20, 38}, {14, 26, 38}};
  const Camera camera = fit_camera(box, {1, 1, -0.4}, {0, 0, 1}, 300, 200, 10);
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  for (const Eigen::Vector3d& point : box) {
    const ScreenPoint seen = camera.project(point);
    left = std::min(left, seen.x), right = std::max(right, seen.x);
    top = std::min(top, seen.y), bottom = std::max(bottom, seen.y);
  }
  EXPECT_NEAR(left + right, 300, 1e-6);
  EXPECT_NEAR(top, 10, 1e-6);
  EXPECT_NEAR(bottom, 190, 1e-6);
  EXPECT_LT(camera.project({10, 20, 38}).y, camera.project({10, 20, 30}).y);
}

// Two faces at a right angle keep their own normals; nearly coplanar faces share a normal.
TEST(ShadingNormals, FoldsStaySharp) {
  const std::vector<std::array<int, 3>> triangles = {{0, 1, 2}, {1, 0, 3}};
  const std::vector<Eigen::Vector3d> fold = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  EXPECT_NEAR(corner_normals(fold, triangles)[0][0].dot(corner_normals(fold, triangles)[1][1]), 0.0, 1e-12);
  const std::vector<Eigen::Vector3d> gentle = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0.1}};
  EXPECT_GT(corner_normals(gentle, triangles)[0][0].dot(corner_normals(gentle, triangles)[1][1]), 0.999);
}

// The near square hides the far square, in either order of drawing.
TEST(Renderer, NearHidesFar) {
  const auto square = [](double y, const Colour& colour) {
    LitSurface surface;
    surface.points = {{-1, y, -1}, {1, y, -1}, {1, y, 1}, {-1, y, 1}};
    surface.triangles = {{0, 1, 2}, {0, 2, 3}};
    surface.values = {0, 0, 0, 0};
    surface.colour = [colour](double) { return colour; };
    return surface;
  };
  const LitSurface near = square(0, {1, 0, 0}), far = square(2, {0, 1, 0});
  const Camera camera = fit_camera(near.points, {0, 1, 0}, {0, 0, 1}, 40, 40, 8);
  for (const auto& surfaces : {std::vector{near, far}, std::vector{far, near}}) {
    const LinearImage image = render(surfaces, camera, 40, 40);
    const std::array<double, 4>& centre = image.pixels[20 * 40 + 20];
    EXPECT_NEAR(centre[3], 1.0, 1e-12);
    EXPECT_GT(centre[0], 0.2);
    EXPECT_EQ(centre[1], 0.0);
    EXPECT_EQ(image.pixels[0][3], 0.0);
  }
}

}  // namespace picture_test
}  // namespace palpate
