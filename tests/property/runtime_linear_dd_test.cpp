// The runtime's linear_dd equals a dense solve of the whole organ and obeys the laws of linear elasticity.
#include <gtest/gtest.h>

#include "offline/numerics/decompositions.hpp"
#include "tests/support/runtime_linear_dd_fixture.hpp"

namespace palpate::test::runtime_linear_dd_fixture {
namespace runtime_linear_dd_test {

// Rounding of the same float64 sums in another order.
constexpr double kRounding = 1e-12;

Eigen::Matrix3d stiffness_of(const pal_contact_result& result) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&result.stiffness[0][0]);
}

TEST_F(RuntimeLinearDd, PatchesHaveSeveralNodes) {  // else half of the tests below prove nothing
  EXPECT_EQ(small_.sites.sites.size(), 12U);
  EXPECT_GE(pack_.info().max_patch_nodes, 5U);
  EXPECT_NE(pack_.info().num_nodes % 32, 0U);  // the last panel is padded
}

TEST_F(RuntimeLinearDd, OneContactAtEverySite) {
  for (size_t site = 0; site < small_.sites.sites.size(); ++site)
    expect_exact({{site, any_displacement()}}, {});
}

TEST_F(RuntimeLinearDd, TwoAndThreeContactsApartAndOverlapping) {
  for (size_t site = 0; site < small_.sites.sites.size(); ++site) {
    expect_exact({{site, any_displacement()}, {(site + 6) % 12, any_displacement()}}, {});
    expect_exact({{site, any_displacement()},
                  {(site + 1) % 12, any_displacement()},
                  {(site + 5) % 12, any_displacement()}},
                 {});
  }
}

TEST_F(RuntimeLinearDd, NodesFixedWhileRunning) {
  expect_exact({{small_.site_at(54), any_displacement()}}, {63});
  expect_exact({{small_.site_at(54), any_displacement()}, {small_.site_at(59), any_displacement()}},
               {62, 51, 52});
  // The fixed node lies in the held patch and stays fixed.
  expect_exact({{small_.site_at(54), any_displacement()}}, {55});
  expect_exact({{small_.site_at(54), any_displacement()}, {small_.site_at(55), any_displacement()}},
               {54, 59});
}

// The same node fixed in the model file gives the same response through all offline stages.
TEST_F(RuntimeLinearDd, FixedWhileRunningIsFixedInTheModel) {
  constexpr int kLabel = 59;  // in the patches of several sites, and the centre of no site used below
  Model fixed_model = small_.model;
  const int node = fixed_model.find_node(kLabel);
  for (int axis = 0; axis < 3; ++axis) fixed_model.fixed.push_back({node, axis, 0.0});
  Scene scene = small_.scene;
  std::erase(scene.sites, node);
  const ContactSites sites = find_contact_sites(scene, fixed_model);
  const Assembly assembly(fixed_model, fixed_model.fixed_dofs());
  const LinearDd linear = compute_linear_dd(assembly, sites);
  const AlignedBytes bytes = write_pack({fixed_model, scene, sites, &linear, nullptr, 0, {}, {}});
  const OpenPack pack(bytes);
  OwnedSession offline(pack.get(), PAL_MODEL_LINEAR, 2, 0);
  session_.fix({contact_node_at(kLabel)});
  for (const int label : {54, 55, 58, 60, 63}) {
    uint32_t site = 0;
    ASSERT_EQ(pal_pack_find_site(pack.get(), label, &site), PAL_STATUS_OK);
    const Eigen::Vector3d d = any_displacement();
    const auto expected = offline.touch({{site, {d[0], d[1], d[2]}, 0, {}, {}, {}}}).front();
    const auto result = session_.touch(as_runtime({{small_.site_at(label), d}})).front();
    EXPECT_LE((force_of(result) - force_of(expected)).norm(), kForceTolerance * force_of(expected).norm());
    EXPECT_LE((stiffness_of(result) - stiffness_of(expected)).norm(),
              kForceTolerance * stiffness_of(expected).norm());
    EXPECT_LE((as_vector(session_.field()) - as_vector(offline.field())).lpNorm<Eigen::Infinity>(),
              kFieldTolerance * d.norm());
  }
}

TEST_F(RuntimeLinearDd, Superposition) {
  const std::vector<size_t> held = {small_.site_at(50), small_.site_at(58), small_.site_at(63)};
  session_.fix({contact_node_at(60)});
  const auto with = [&](const std::array<Eigen::Vector3d, 3>& d) {
    const auto results = session_.touch(as_runtime({{held[0], d[0]}, {held[1], d[1]}, {held[2], d[2]}}));
    Eigen::VectorXd forces(9);
    for (int c = 0; c < 3; ++c) forces.segment<3>(3 * c) = force_of(results[static_cast<size_t>(c)]);
    return std::pair(forces, as_vector(session_.field()));
  };
  std::array<Eigen::Vector3d, 3> a;
  std::array<Eigen::Vector3d, 3> b;
  std::array<Eigen::Vector3d, 3> both;
  for (size_t c = 0; c < 3; ++c) {
    a[c] = any_displacement();
    b[c] = any_displacement();
    both[c] = 2 * a[c] - 3 * b[c];
  }
  const auto [force_a, field_a] = with(a);
  const auto [force_b, field_b] = with(b);
  const auto [force, field] = with(both);
  EXPECT_LE((force - 2 * force_a + 3 * force_b).norm(), kRounding * force.norm());
  EXPECT_LE((field - 2 * field_a + 3 * field_b).norm(), kFieldTolerance * field.norm());
}

// Betti: the work of one state's forces on the other's displacements is mutual. Unit pushes give all columns
// of S.
TEST_F(RuntimeLinearDd, StiffnessIsSymmetricAndPositive) {
  for (const bool fixed : {false, true}) {
    session_.fix(fixed ? std::vector<uint32_t>{contact_node_at(59), contact_node_at(51)}
                       : std::vector<uint32_t>{});
    const std::vector<size_t> held = {small_.site_at(53), small_.site_at(54), small_.site_at(62)};
    Eigen::MatrixXd S(9, 9);
    for (int column = 0; column < 9; ++column) {
      Contacts contacts;
      for (size_t c = 0; c < 3; ++c) {
        Eigen::Vector3d d = Eigen::Vector3d::Zero();
        if (column / 3 == static_cast<int>(c)) d[column % 3] = 0.01;
        contacts.emplace_back(held[c], d);
      }
      const auto results = session_.touch(as_runtime(contacts));
      for (int c = 0; c < 3; ++c) {
        const auto& result = results[static_cast<size_t>(c)];
        S.block<3, 1>(3 * c, column) = force_of(result) / 0.01;
        // The reported stiffness is the derivative of the reported force.
        if (column / 3 == c) {
          EXPECT_LE((stiffness_of(result).col(column % 3) - S.block<3, 1>(3 * c, column)).norm(),
                    kRounding * stiffness_of(result).norm());
        }
        EXPECT_EQ(stiffness_of(result), stiffness_of(result).transpose());
      }
    }
    EXPECT_LE((S - S.transpose()).norm(), kRounding * S.norm());
    EXPECT_GT(symmetric_modes(S).values.minCoeff(), 0);
  }
}

// Global equilibrium: the base carries the tools' forces, without a net moment. The base's share is K u, for
// the field u of the runtime.
TEST(RuntimeLinearDdWhole, ForcesAndReactionsCancel) {
  TouchedBlock block = touched_block(4, 0.26);
  block.model.materials.front().law = LinearElastic{3.0, 0.3};
  show_every_node(block);
  const Assembly assembly(block.model, block.model.fixed_dofs());
  const LinearDd linear = compute_linear_dd(assembly, block.sites);
  const AlignedBytes bytes = write_pack({block.model, block.scene, block.sites, &linear, nullptr, 0, {}, {}});
  const OpenPack pack(bytes);
  OwnedSession session(pack.get(), PAL_MODEL_LINEAR, 2, 0);
  const auto results =
      session.touch({{0, {0.02, -0.01, -0.03}, 0, {}, {}, {}}, {8, {0.01, 0.03, 0.01}, 0, {}, {}, {}}});
  Eigen::VectorXd internal;
  assembly.internal_force(as_vector(session.field()), internal);
  Eigen::Vector3d applied = Eigen::Vector3d::Zero();
  Eigen::Vector3d in_the_base = Eigen::Vector3d::Zero();
  for (const pal_contact_result& result : results) applied += force_of(result);
  const std::vector<char> fixed = block.model.fixed_nodes();
  double largest = 0;
  for (int node = 0; node < block.model.num_nodes(); ++node) {
    const Eigen::Vector3d force = internal.segment<3>(3 * node);
    largest = std::max(largest, force.norm());
    if (fixed[static_cast<size_t>(node)] != 0) in_the_base += force;
  }
  EXPECT_GT(applied.norm(), 1e-2);
  EXPECT_LE((applied + in_the_base).norm(), kFieldTolerance * static_cast<double>(fixed.size()) * largest);
}

// A field of many panels, the last of them not full, written into the caller's memory with every layout.
TEST(RuntimeLinearDdWhole, FieldOfManyPanelsWhereverItGoes) {
  TouchedBlock block = touched_block(10, 0);
  block.scene.sites.resize(2);
  show_every_node(block);
  const Assembly assembly(block.model, block.model.fixed_dofs());
  const LinearDd linear = compute_linear_dd(assembly, block.sites);
  const AlignedBytes bytes = write_pack({block.model, block.scene, block.sites, &linear, nullptr, 0, {}, {}});
  const OpenPack pack(bytes);
  const uint32_t nodes = pack.info().num_nodes;
  ASSERT_GT(nodes, 33U * 32U);
  ASSERT_NE(nodes % 32, 0U);
  pal_session_config config = session_config(pack.get(), PAL_MODEL_LINEAR, 2, 0);
  config.max_requested = nodes;
  OwnedSession session(pack.get(), config);
  const Eigen::Vector3d f[2] = {{0.3, -0.2, -1}, {-0.1, 0.4, -0.7}};
  for (size_t count = 1; count <= 2; ++count) {
    std::vector<pal_contact> contacts;
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(Eigen::Index{3} * nodes);
    for (size_t c = 0; c < count; ++c) {
      contacts.push_back({static_cast<uint32_t>(c), {}, 7, {f[c][0], f[c][1], f[c][2]}, {}, {}});
      expected += linear.field_compliance.middleCols<3>(static_cast<Eigen::Index>(3 * c)) * f[c];
    }
    session.touch(contacts);
    const std::vector<pal_real> field = session.field();
    EXPECT_LE((as_vector(field) - expected).lpNorm<Eigen::Infinity>(),
              kFieldTolerance * expected.lpNorm<Eigen::Infinity>());
    const auto* expected_bytes = reinterpret_cast<const unsigned char*>(field.data());
    for (const size_t stride : {kNodeBytes, kNodeBytes + 4}) {
      std::vector<unsigned char> bytes_of_field(1 + stride * nodes);
      auto* out = reinterpret_cast<pal_real*>(bytes_of_field.data() + 1);
      require(pal_visual_frame(session.get(), out, stride), "frame off its alignment");
      for (uint32_t node = 0; node < nodes; ++node)
        ASSERT_TRUE(std::equal(expected_bytes + node * kNodeBytes, expected_bytes + (node + 1) * kNodeBytes,
                               bytes_of_field.data() + 1 + node * stride));
    }
    std::vector<uint32_t> all(nodes);
    std::iota(all.begin(), all.end(), 0U);
    require(pal_session_request_nodes(session.get(), all.data(), nodes), "request");
    EXPECT_EQ(session.field(), field);
    require(pal_session_request_nodes(session.get(), nullptr, 0), "request");
  }
}

TEST_F(RuntimeLinearDd, OrderOfContactsDoesNotMatter) {
  const Contacts contacts = {{3, any_displacement()}, {4, any_displacement()}, {9, any_displacement()}};
  const auto one_way = session_.touch(as_runtime(contacts));
  const auto other_way = session_.touch(as_runtime({contacts[2], contacts[0], contacts[1]}));
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_LE((force_of(one_way[c]) - force_of(other_way[(c + 1) % 3])).norm(),
              kForceTolerance * force_of(one_way[c]).norm());
  }
}

TEST_F(RuntimeLinearDd, ReleasedTissueIsAtRest) {
  session_.touch(as_runtime({{2, any_displacement()}, {7, any_displacement()}}));
  EXPECT_GT(as_vector(session_.field()).norm(), 0);
  EXPECT_EQ(pal_contact_frame(session_.get(), nullptr, 0, nullptr), PAL_STATUS_OK);
  EXPECT_EQ(as_vector(session_.field()).norm(), 0);
  // Held at zero displacement: at rest too.
  const auto results = session_.touch({{2, {0, 0, 0}, 0, {}, {}, {}}});
  EXPECT_EQ(force_of(results[0]).norm(), 0);
  EXPECT_EQ(as_vector(session_.field()).norm(), 0);
}

// Earlier contacts and fixed nodes leave only rounding.
TEST_F(RuntimeLinearDd, AnswerDoesNotDependOnThePast) {
  const std::vector<pal_contact> contacts = as_runtime({{2, any_displacement()}, {7, any_displacement()}});
  OwnedSession fresh(pack_.get(), PAL_MODEL_LINEAR, 4, 8);
  const auto expected = fresh.touch(contacts);
  session_.fix({1, 2, 3, 4});
  session_.touch(as_runtime({{5, any_displacement()}, {6, any_displacement()}, {1, any_displacement()}}));
  session_.fix({});
  const auto results = session_.touch(contacts);
  for (size_t c = 0; c < 2; ++c) EXPECT_TRUE(are_alike(results[c], expected[c]));
  EXPECT_LE((as_vector(session_.field()) - as_vector(fresh.field())).norm(),
            kFieldTolerance * as_vector(fresh.field()).norm());
}

TEST_F(RuntimeLinearDd, OneSiteHeldTwiceFollowsTheMean) {
  const Eigen::Vector3d a = any_displacement();
  const Eigen::Vector3d b = any_displacement();
  const auto results = session_.touch(as_runtime({{4, a}, {4, b}}));
  const std::vector<pal_real> field = session_.field();
  const auto mean = session_.touch(as_runtime({{4, 0.5 * (a + b)}}));
  const Eigen::Vector3d force = force_of(results[0]) + force_of(results[1]);
  EXPECT_LE((force - force_of(mean[0])).norm(), kForceTolerance * force.norm());
  EXPECT_LE((as_vector(field) - as_vector(session_.field())).norm(),
            kFieldTolerance * as_vector(field).norm());
  for (const auto& result : results) {
    EXPECT_TRUE(all_finite(result));
    EXPECT_TRUE(result.flags & PAL_FLAG_OVERLAPPING);
  }
  EXPECT_FALSE(mean[0].flags & PAL_FLAG_OVERLAPPING);
}

TEST_F(RuntimeLinearDd, ContactWhollyOnFixedNodes) {
  const std::vector<int>& patch = small_.sites.sites[4].patch;
  session_.fix({patch.begin(), patch.end()});
  const auto results = session_.touch(as_runtime({{4, any_displacement()}}));
  EXPECT_EQ(force_of(results[0]).norm(), 0);  // no node of the patch follows the tool
  EXPECT_EQ(as_vector(session_.field()).norm(), 0);
  // A node named twice is fixed once.
  session_.fix({static_cast<uint32_t>(patch[0]), static_cast<uint32_t>(patch[0])});
  EXPECT_TRUE(all_finite(session_.touch(as_runtime({{4, any_displacement()}}))[0]));
}

TEST_F(RuntimeLinearDd, FixingANodeChangesNothingBeforeTheNextFrame) {
  const auto contacts = as_runtime({{4, {0.01, 0, -0.03}}});
  OwnedSession session(pack_.get(), PAL_MODEL_LINEAR, 1, 2);
  session.touch(contacts);
  const std::vector<pal_real> before = session.field();
  session.fix({0, 1});
  EXPECT_EQ(session.field(), before);
  session.touch(contacts);
  EXPECT_NE(session.field(), before);
}

}  // namespace runtime_linear_dd_test
}  // namespace palpate::test::runtime_linear_dd_fixture
