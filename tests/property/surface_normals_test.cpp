// Normals of the displaced surface.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"

namespace palpate::test {
namespace surface_normals_test {

constexpr double kFloat = 1e-5;  // a few float32 roundings of numbers near 1

class SurfaceNormals : public ::testing::Test {
 protected:
  Eigen::Vector3d position(uint32_t node) const {
    return Eigen::Map<const Eigen::Vector3d>(pack_.face().geometry().positions + size_t{3} * node);
  }
  std::vector<pal_real> normals(const std::vector<pal_real>& displacements) const {
    std::vector<pal_real> normals(displacements.size(), 9.0f);
    require(
        pal_pack_compute_normals(pack_.get(), displacements.data(), kNodeBytes, normals.data(), kNodeBytes),
        "normals");
    return normals;
  }
  Eigen::Vector3d at_node(const std::vector<pal_real>& field, uint32_t node) const {
    return Eigen::Map<const Eigen::Matrix<pal_real, 3, 1>>(field.data() + size_t{3} * node).cast<double>();
  }
  bool has_triangle(uint32_t node) const {
    const pal_geometry geometry = pack_.face().geometry();
    for (uint32_t i = 0; i < 3 * geometry.num_triangles; ++i) {
      if (geometry.triangles[i] == node) return true;
    }
    return false;
  }

  OpenPack pack_{small_pack_bytes()};
  uint32_t num_nodes_ = pack_.info().num_nodes;
  std::vector<pal_real> rest_ = std::vector<pal_real>(size_t{3} * num_nodes_, 0.0f);
};

TEST_F(SurfaceNormals, PointOutOfTheBlock) {
  const std::vector<pal_real> field = normals(rest_);
  constexpr double kTop = 0.375;
  int on_top = 0;
  for (uint32_t node = 0; node < num_nodes_; ++node) {
    const Eigen::Vector3d n = at_node(field, node);
    if (!has_triangle(node)) {
      EXPECT_EQ(n.norm(), 0);
      continue;
    }
    EXPECT_NEAR(n.norm(), 1, kFloat);
    const Eigen::Vector3d x = position(node);
    const Eigen::Vector3d outward = x - Eigen::Vector3d::Constant(0.5 * kTop);
    EXPECT_GT(n.dot(outward), 0) << "node " << node;
    const bool inner =
        x[2] > kTop - 1e-9 && x.head<2>().minCoeff() > 1e-9 && x.head<2>().maxCoeff() < kTop - 1e-9;
    if (!inner) continue;
    ++on_top;
    EXPECT_LE((n - Eigen::Vector3d::UnitZ()).norm(), kFloat);
  }
  EXPECT_EQ(on_top, 4);
}

TEST_F(SurfaceNormals, TurnWithTheSurface) {
  const std::vector<pal_real> before = normals(rest_);
  const Eigen::Matrix3d R = rotation_vector({0.8, -1.2, 2.0});
  std::vector<pal_real> displacements = rest_;
  for (uint32_t node = 0; node < num_nodes_; ++node) {
    const Eigen::Vector3d u = R * position(node) - position(node) + Eigen::Vector3d(0.3, -0.2, 0.1);
    for (int i = 0; i < 3; ++i)
      displacements[3 * node + static_cast<uint32_t>(i)] = static_cast<pal_real>(u[i]);
  }
  const std::vector<pal_real> after = normals(displacements);
  for (uint32_t node = 0; node < num_nodes_; ++node)
    EXPECT_LE((at_node(after, node) - R * at_node(before, node)).norm(), kFloat);
}

TEST_F(SurfaceNormals, StridesWriteTheirThreeNumbersAndNoMore) {
  const std::vector<pal_real> expected = normals(rest_);
  constexpr unsigned char kCanary = 0xa5;
  for (const size_t stride : {kNodeBytes, kNodeBytes + 1, kNodeBytes + 20}) {
    std::vector<unsigned char> buffer(stride * num_nodes_ + 64, kCanary);
    ASSERT_EQ(pal_pack_compute_normals(pack_.get(), rest_.data(), kNodeBytes,
                                       reinterpret_cast<pal_real*>(buffer.data()), stride),
              PAL_STATUS_OK);
    for (size_t node = 0; node < num_nodes_; ++node) {
      EXPECT_EQ(std::memcmp(buffer.data() + node * stride, expected.data() + 3 * node, kNodeBytes), 0);
      for (size_t byte = kNodeBytes; byte < stride; ++byte) ASSERT_EQ(buffer[node * stride + byte], kCanary);
    }
    for (size_t byte = stride * num_nodes_; byte < buffer.size(); ++byte) ASSERT_EQ(buffer[byte], kCanary);
  }
  pal_real* const out = rest_.data();
  EXPECT_EQ(pal_pack_compute_normals(pack_.get(), rest_.data(), kNodeBytes - 1, out, kNodeBytes),
            PAL_STATUS_BAD_ARGUMENT);
  EXPECT_EQ(pal_pack_compute_normals(pack_.get(), rest_.data(), kNodeBytes, out, kNodeBytes - 1),
            PAL_STATUS_BAD_ARGUMENT);
  EXPECT_EQ(pal_pack_compute_normals(nullptr, rest_.data(), kNodeBytes, out, kNodeBytes),
            PAL_STATUS_NULL_ARGUMENT);
  EXPECT_EQ(pal_pack_compute_normals(pack_.get(), nullptr, kNodeBytes, out, kNodeBytes),
            PAL_STATUS_NULL_ARGUMENT);
  EXPECT_EQ(pal_pack_compute_normals(pack_.get(), rest_.data(), kNodeBytes, nullptr, kNodeBytes),
            PAL_STATUS_NULL_ARGUMENT);
}

TEST_F(SurfaceNormals, StayFiniteWhateverTheDisplacements) {
  for (const pal_real size :
       {std::numeric_limits<pal_real>::denorm_min(), pal_real{1e20f}, std::numeric_limits<pal_real>::max(),
        pal_real{std::nanf("")}, std::numeric_limits<pal_real>::infinity()}) {
    std::vector<pal_real> displacements = rest_;
    for (size_t i = 0; i < displacements.size(); i += 2) displacements[i] = size;
    EXPECT_TRUE(all_finite(normals(displacements))) << size;
  }
  // Folded flat: all triangles have zero area.
  std::vector<pal_real> flat = rest_;
  for (uint32_t node = 0; node < num_nodes_; ++node) {
    for (int i = 0; i < 3; ++i)
      flat[3 * node + static_cast<uint32_t>(i)] = static_cast<pal_real>(-position(node)[i]);
  }
  EXPECT_TRUE(all_finite(normals(flat)));
}

}  // namespace surface_normals_test
}  // namespace palpate::test
