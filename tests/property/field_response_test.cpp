// The update of the field's response, against the change of the field that it has to explain.
#include "runtime/src/refining/field_response.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "runtime/src/numerics/pose.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_mailbox.hpp"
#include "tests/support/nonlinear_zone_fixture.hpp"

namespace palpate {
namespace field_response_test {

using Eigen::VectorXd;

constexpr uint32_t kAxes = 6;  // a contact whose patch turns
constexpr double kFloat = 1e-5;

TEST(FieldResponse, ExplainsTheLastChangeOfTheField) {
  const pal_pack& pack = *test::tissue_block(1).pack->get();
  const double edge = pack.mean_surface_edge;
  const size_t size = field_size(pack);
  std::vector<pal_real> columns(kAxes * size, pal_real(0.25));
  const std::vector<pal_real> at_first = columns;
  FieldResponse response = {};
  response.num_contacts = 1;
  response.num_axes = kAxes;
  response.of_packed = columns.data();
  const double from[kAxes] = {0.01 * edge, 0, -0.02 * edge, 0.01, 0, 0};
  std::copy_n(from, kAxes, response.followed);
  srand(3);  // Eigen's Random()
  const VectorXd before = VectorXd::Random(3 * static_cast<Eigen::Index>(pack.organ.num_nodes));
  const VectorXd now = before + 0.05 * edge * VectorXd::Random(before.size());
  const double hardly[kAxes] = {0.011 * edge, 0, -0.02 * edge, 0.01, 0, 0};
  update_field_response(pack, hardly, before.data(), now.data(), response);
  const double far[kAxes] = {0.4 * edge, 0, -0.02 * edge, 0.01, 0, 0};
  update_field_response(pack, far, before.data(), now.data(), response);
  EXPECT_EQ(columns, at_first);
  std::copy_n(from, kAxes, response.followed);
  const double to[kAxes] = {0.05 * edge, 0.02 * edge, -0.06 * edge, 0.01, -0.03, 0.02};
  update_field_response(pack, to, before.data(), now.data(), response);
  double change[kAxes];
  for (uint32_t a = 0; a < 3; ++a) change[a] = (to[a] - from[a]) * pack.metres;
  find_turn_change(from + 3, to + 3, change + 3);
  size_t compared = 0;
  for (uint32_t node = 0; node < pack.organ.num_nodes; ++node) {
    const size_t packed = pack.organ.nodes[node].packed_node;
    if (packed == pack::kNoNode) continue;
    ++compared;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      double explained = 0;
      for (uint32_t a = 0; a < kAxes; ++a)
        explained += static_cast<double>(columns[a * size + 3 * packed + axis]) * change[a];
      const Eigen::Index at = 3 * static_cast<Eigen::Index>(node) + axis;
      EXPECT_NEAR(explained, (now[at] - before[at]) * pack.metres, kFloat * edge * pack.metres);
    }
  }
  EXPECT_GT(compared, 100U);
}

}  // namespace field_response_test
}  // namespace palpate
