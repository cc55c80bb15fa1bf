// The runtime's response with a compressed compliance, compared with the dense compliance of the same organ.
#include <gtest/gtest.h>

#include <algorithm>

#include "offline/numerics/decompositions.hpp"
#include "runtime/src/pack/compliance.hpp"
#include "runtime/src/pack/compressed_compliance.hpp"
#include "tests/support/compressed_pack.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace runtime_compressed_test {

// For an entry tolerance of 1e-4: over the largest force, and over the tool's displacement.
constexpr double kForceError = 5e-4;
constexpr double kFieldError = 2e-3;
// The patch of a contact is near itself: its blocks are uncompressed, in float32.
constexpr double kOneForceError = 1e-6;

using Contacts = std::vector<pal_contact>;

class RuntimeCompressed : public ::testing::Test {
 protected:
  RuntimeCompressed()
      : dense_pack_(dense_surface_pack()),
        pack_(compressed_surface_pack()),
        dense_(dense_pack_.get(), PAL_MODEL_LINEAR, 12, 200),
        session_(pack_.get(), PAL_MODEL_LINEAR, 12, 200) {}

  Contacts any_contacts(size_t count) {
    Contacts contacts;
    for (size_t c = 0; c < count; ++c) {
      const Eigen::Vector3d d = 0.05 * random_.vector();
      contacts.push_back({any(pack_.info().num_sites), {d[0], d[1], d[2]}, 0, {}, {}, {}});
    }
    return contacts;
  }

  uint32_t any(uint32_t count) {
    return std::min(static_cast<uint32_t>((random_() + 1) / 2 * count), count - 1);
  }

  void expect_alike(const Contacts& contacts, double force_error) {
    const auto expected = dense_.touch(contacts);
    const auto results = session_.touch(contacts);
    double largest_force = 0;
    double largest = 0;
    for (size_t c = 0; c < contacts.size(); ++c) {
      largest_force = std::max(largest_force, Eigen::Vector3d(expected[c].force).norm());
      largest = std::max(largest, Eigen::Vector3d(contacts[c].displacement).norm());
    }
    for (size_t c = 0; c < contacts.size(); ++c) {
      EXPECT_LE((Eigen::Vector3d(results[c].force) - Eigen::Vector3d(expected[c].force)).norm(),
                force_error * largest_force);
      EXPECT_EQ(results[c].flags, expected[c].flags);
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) EXPECT_EQ(results[c].stiffness[i][j], results[c].stiffness[j][i]);
      }
    }
    EXPECT_LE((as_vector(session_.field()) - as_vector(dense_.field())).lpNorm<Eigen::Infinity>(),
              kFieldError * largest);
  }

  TestRandom random_{11};
  OpenPack dense_pack_;
  OpenPack pack_;
  OwnedSession dense_;
  OwnedSession session_;
};

TEST_F(RuntimeCompressed, IsCompressedAndKeepsFixedNodesApart) {  // else the tests below prove nothing
  EXPECT_TRUE(is_compressed(*pack_.get()));
  EXPECT_FALSE(is_compressed(*dense_pack_.get()));
  EXPECT_EQ(pack_.info().has_linear, 1U);
  EXPECT_EQ(pack_.info().num_contact_nodes, dense_pack_.info().num_contact_nodes);
  EXPECT_LT(pack_.info().num_contact_nodes, pack_.info().num_nodes);
  EXPECT_LT(compressed_surface_pack().bytes().size(), dense_surface_pack().bytes().size() / 2);
}

TEST_F(RuntimeCompressed, OneContact) {
  for (int trial = 0; trial < 40; ++trial) expect_alike(any_contacts(1), kOneForceError);
}

TEST_F(RuntimeCompressed, SeveralContacts) {
  for (int trial = 0; trial < 20; ++trial) {
    expect_alike(any_contacts(3), kForceError);
    expect_alike(any_contacts(12), kForceError);
  }
}

TEST_F(RuntimeCompressed, NodesFixedWhileRunning) {
  for (const size_t count : {size_t{5}, size_t{200}}) {
    std::vector<uint32_t> fixed;
    for (size_t i = 0; i < count; ++i) fixed.push_back(any(pack_.info().num_contact_nodes));
    session_.fix(fixed);
    dense_.fix(fixed);
    for (int trial = 0; trial < 5; ++trial) expect_alike(any_contacts(2), kForceError);
  }
}

TEST_F(RuntimeCompressed, ContactsWithGivenForces) {
  for (int trial = 0; trial < 10; ++trial) {
    Contacts contacts = any_contacts(2);
    contacts[1].force_axes = 7;
    const Eigen::Vector3d force = 0.01 * random_.vector();
    std::copy(force.begin(), force.end(), contacts[1].force);
    const auto expected = dense_.touch(contacts);
    const auto results = session_.touch(contacts);
    EXPECT_LE((Eigen::Vector3d(results[0].force) - Eigen::Vector3d(expected[0].force)).norm(),
              kForceError * Eigen::Vector3d(expected[0].force).norm());
    const Eigen::VectorXd field = as_vector(dense_.field());
    EXPECT_LE((as_vector(session_.field()) - field).lpNorm<Eigen::Infinity>(),
              kFieldError * field.lpNorm<Eigen::Infinity>());
  }
}

TEST_F(RuntimeCompressed, ComplianceIsSymmetricToTheBitAndPositive) {
  std::vector<uint32_t> nodes;
  for (int i = 0; i < 60; ++i) {
    const uint32_t node = any(pack_.info().num_contact_nodes);
    if (std::find(nodes.begin(), nodes.end(), node) == nodes.end()) nodes.push_back(node);
  }
  const auto size = static_cast<Eigen::Index>(3 * nodes.size());
  Eigen::MatrixXd compliance(size, size);
  for (size_t i = 0; i < nodes.size(); ++i) {
    for (size_t j = 0; j < nodes.size(); ++j) {
      double block[9];
      contact_compliance(*pack_.get(), nodes[i], nodes[j], block);
      compliance.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j)) =
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(block);
    }
  }
  EXPECT_EQ(compliance, compliance.transpose());
  EXPECT_GT(symmetric_modes(compliance).values.minCoeff(), 0);
}

TEST_F(RuntimeCompressed, RequestedNodesAreThoseOfTheWholeField) {
  pal_session_config config = session_config(pack_.get(), PAL_MODEL_LINEAR, 3, 0);
  config.max_requested = pack_.info().num_nodes;
  OwnedSession session(pack_.get(), config);
  session.touch(any_contacts(3));
  const std::vector<pal_real> whole = session.field();
  for (const uint32_t step : {1U, 2U, 7U, 97U}) {
    std::vector<uint32_t> asked;
    for (uint32_t node = step - 1; node < pack_.info().num_nodes; node += step) asked.push_back(node);
    require(pal_session_request_nodes(session.get(), asked.data(), static_cast<uint32_t>(asked.size())),
            "request");
    constexpr size_t kStride = 5;  // numbers; the last two are the caller's
    std::vector<pal_real> some(kStride * asked.size(), -7.0f);
    require(pal_visual_frame(session.get(), some.data(), kStride * sizeof(pal_real)), "frame");
    for (size_t i = 0; i < asked.size(); ++i) {
      for (size_t axis = 0; axis < 3; ++axis)
        EXPECT_EQ(some[kStride * i + axis], whole[size_t{3} * asked[i] + axis]);
      EXPECT_EQ(some[kStride * i + 3], -7.0f);
    }
  }
  // At rest, too.
  require(pal_contact_frame(session.get(), nullptr, 0, nullptr), "release");
  std::vector<pal_real> some(3 * 14, -7.0f);
  const uint32_t two[] = {3, 70};
  require(pal_session_request_nodes(session.get(), two, 2), "request");
  require(pal_visual_frame(session.get(), some.data(), kNodeBytes), "frame");
  for (size_t i = 0; i < 6; ++i) EXPECT_EQ(some[i], 0.0f);
}

TEST_F(RuntimeCompressed, FixedNodesOfTheModelStay) {
  session_.touch(any_contacts(3));
  const std::vector<pal_real> field = session_.field();
  const TouchedBlock& block = touched_surface().block;
  size_t still = 0;
  for (size_t i = 0; i < block.sites.packed_nodes.size(); ++i) {
    const bool held = block.model.positions[static_cast<size_t>(block.sites.packed_nodes[i])].z() < 1e-9;
    still += held ? 1 : 0;
    for (size_t axis = 0; axis < 3; ++axis) EXPECT_EQ(field[3 * i + axis] == 0, held);
  }
  EXPECT_GT(still, 100U);
}

// The zone of a contact is the same with either compliance, which moves the contact from the nearest site to its place.
TEST(RuntimeCompressedZones, DifferByTheTransferToAPlace) {
  const TouchedSurface& surface = touched_surface();
  const ZoneTables zone = find_zones(surface.block.model, surface.block.sites, 1);
  const AlignedBytes dense_bytes = surface.write(&dense_compliance(), nullptr, &zone);
  const AlignedBytes bytes = surface.write(nullptr, &compressed_compliance(), &zone);
  const OpenPack dense_pack(dense_bytes);
  const OpenPack pack(bytes);
  ASSERT_TRUE(is_compressed(*pack.get()));
  pal_session_config config = session_config(pack.get(), PAL_MODEL_ZONE, 2, 0);
  config.max_requested = 3;
  OwnedSession dense(dense_pack.get(), config);
  OwnedSession session(pack.get(), config);
  const double place[3] = {0.43, 0.52, 1};
  const double push[3] = {0.01, 0.02, -0.03};
  pal_surface_point point;
  require(pal_pack_find_surface_point(pack.get(), place, &point), "surface");
  ASSERT_LT(*std::max_element(point.weights, point.weights + 3), 0.9);
  const pal_contact at_site = {point.sites[0], {push[0], push[1], push[2]}, 0, {}, {}, {}};
  const auto difference = [&](const pal_contact& contact) {
    const auto expected = settle(dense, {contact});
    const auto results = settle(session, {contact});
    EXPECT_EQ(results[0].flags, expected[0].flags);
    const Eigen::Vector3d force(expected[0].force);
    return std::pair((Eigen::Vector3d(results[0].force) - force).norm() / force.norm(),
                     (as_vector(session.field()) - as_vector(dense.field())).lpNorm<Eigen::Infinity>());
  };
  const auto [force, field] = difference(at_site);
  EXPECT_EQ(force, 0);
  EXPECT_EQ(field, 0);
  const auto [moved_force, moved_field] = difference(pal_contact_at(&point, push));
  EXPECT_LE(moved_force, kForceError);
  EXPECT_LE(moved_field, kFieldError * Eigen::Vector3d(push).norm());
  EXPECT_GT(moved_field, 0);
  const std::vector<pal_real> whole = session.field();
  const uint32_t asked[] = {1, 40, 100};
  require(pal_session_request_nodes(session.get(), asked, 3), "request");
  pal_real some[9];
  require(pal_visual_frame(session.get(), some, kNodeBytes), "frame");
  for (size_t i = 0; i < 9; ++i) EXPECT_EQ(some[i], whole[size_t{3} * asked[i / 3] + i % 3]);
}

// A pack with little compression: panels that are not full, all blocks uncompressed.
TEST(RuntimeCompressedSmall, EverythingNear) {
  const TouchedSurface small(3);
  const LinearDd linear = compute_linear_dd(small.assembly, small.block.sites);
  const CompressedCompliance compressed = compress_linear_dd(small.assembly, small.block.sites, 1e-4);
  const AlignedBytes dense_bytes = small.write(&linear, nullptr);
  const AlignedBytes bytes = small.write(nullptr, &compressed);
  const OpenPack dense_pack(dense_bytes);
  const OpenPack pack(bytes);
  OwnedSession dense(dense_pack.get(), PAL_MODEL_LINEAR, 2, 0);
  OwnedSession session(pack.get(), PAL_MODEL_LINEAR, 2, 0);
  const Contacts contacts = {{0, {0.01, 0, 0.02}, 0, {}, {}, {}}, {20, {0.01, 0.03, 0}, 0, {}, {}, {}}};
  const auto expected = dense.touch(contacts);
  const auto results = session.touch(contacts);
  for (size_t c = 0; c < 2; ++c) {
    EXPECT_LE((Eigen::Vector3d(results[c].force) - Eigen::Vector3d(expected[c].force)).norm(),
              kForceError * Eigen::Vector3d(expected[0].force).norm());
  }
  const std::vector<pal_real> exact = dense.field();
  const std::vector<pal_real> field = session.field();
  for (size_t i = 0; i < field.size(); ++i) EXPECT_NEAR(field[i], exact[i], kFieldError * 0.03);
}

}  // namespace runtime_compressed_test
}  // namespace palpate::test
