// A pack that states mm and mN answers in metres and newtons: the same numbers, scaled.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace runtime_units_test {

constexpr double kMetres = 1e-3;
constexpr double kNewtons = 1e-3;
// A handful of float64 roundings, with the division by 1e-3 on the way in.
constexpr double kRounding = 1e-13;
// Two float32 sums of up to 50 products with cancellation, over the largest displacement.
constexpr double kFieldRounding = 1e-5;

class RuntimeUnits : public ::testing::Test {
 protected:
  const AlignedBytes with_units_ = small_pack().write_with_units();
  OpenPack plain_{small_pack_bytes()};
  OpenPack scaled_{with_units_};
};

TEST_F(RuntimeUnits, InfoSpeaksSiWhereUnitsAreStated) {
  const pal_pack_info plain = plain_.info();
  const pal_pack_info scaled = scaled_.info();
  EXPECT_EQ(plain.has_units, 0U);
  EXPECT_EQ(plain.metres_per_length_unit, 1);
  EXPECT_EQ(plain.newtons_per_force_unit, 1);
  EXPECT_EQ(scaled.has_units, 1U);
  EXPECT_EQ(scaled.metres_per_length_unit, kMetres);
  EXPECT_EQ(scaled.newtons_per_force_unit, kNewtons);
  EXPECT_DOUBLE_EQ(scaled.max_displacement, kMetres * plain.max_displacement);
  EXPECT_DOUBLE_EQ(scaled.tip_radius, kMetres * plain.tip_radius);
  EXPECT_DOUBLE_EQ(scaled.mean_surface_edge, kMetres * plain.mean_surface_edge);
  // Geometry keeps the model file's numbers, whatever the units.
  const pal_geometry a = plain_.face().geometry();
  const pal_geometry b = scaled_.face().geometry();
  ASSERT_EQ(a.num_nodes, b.num_nodes);
  for (uint32_t i = 0; i < 3 * a.num_nodes; ++i) EXPECT_EQ(a.positions[i], b.positions[i]);
}

TEST_F(RuntimeUnits, AnswersScale) {
  for (const pal_model model : {PAL_MODEL_LINEAR, PAL_MODEL_POLYNOMIAL}) {
    OwnedSession plain(plain_.get(), model, 2, 0);
    OwnedSession scaled(scaled_.get(), model, 2, 0);
    for (uint32_t site = 0; site < 12; ++site) {
      for (const double reach : {0.3, 1.0, 2.0, 10.0, 1e9}) {
        const double d = reach * kMaxDisplacement;
        std::vector<pal_contact> contacts = {{site, {0.3 * d, -0.5 * d, 0.7 * d}, 0, {}, {}, {}}};
        if (model == PAL_MODEL_LINEAR)
          contacts.push_back({(site + 1) % 12, {0, 0.2 * d, -0.4 * d}, 0, {}, {}, {}});
        std::vector<pal_contact> in_metres = contacts;
        for (pal_contact& contact : in_metres) {
          for (double& component : contact.displacement) component *= kMetres;
        }
        const auto expected = plain.touch(contacts);
        const auto results = scaled.touch(in_metres);
        for (size_t c = 0; c < contacts.size(); ++c) {
          EXPECT_EQ(results[c].flags, expected[c].flags);
          EXPECT_EQ(results[c].displacement_error, expected[c].displacement_error);
          EXPECT_EQ(results[c].force_error, expected[c].force_error);
          const Eigen::Vector3d force = kNewtons * Eigen::Vector3d(expected[c].force);
          EXPECT_LE((Eigen::Vector3d(results[c].force) - force).norm(), kRounding * force.norm());
          const Eigen::Map<const Eigen::Matrix3d> S(&expected[c].stiffness[0][0]);
          const Eigen::Map<const Eigen::Matrix3d> in_si(&results[c].stiffness[0][0]);
          EXPECT_LE((in_si - kNewtons / kMetres * S).norm(), kRounding * S.norm());
        }
        const std::vector<pal_real> in_model = plain.field();
        const std::vector<pal_real> field = scaled.field();
        pal_real largest = 0;
        for (const pal_real value : in_model) largest = std::max(largest, std::abs(value));
        for (size_t i = 0; i < field.size(); ++i) {
          ASSERT_NEAR(static_cast<double>(field[i]), kMetres * static_cast<double>(in_model[i]),
                      kFieldRounding * kMetres * static_cast<double>(largest));
        }
      }
    }
  }
}

}  // namespace runtime_units_test
}  // namespace palpate::test
