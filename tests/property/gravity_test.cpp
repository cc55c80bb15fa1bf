// Gravity: the organ's equilibrium under it, and the response of contacts and tools when gravity turns.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "offline/precompute/rest_state.hpp"
#include "schemas/pack_generated.h"
#include "tests/support/blended_answers.hpp"
#include "tests/support/dense_reference.hpp"
#include "tests/support/tool_session.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate::test {
namespace gravity_test {

constexpr double kForceTolerance = 1e-10;  // as in runtime_linear_dd_test.cpp
constexpr double kFieldTolerance = field_tolerance(1e-5);

// A block on its base that sags sideways and down.
struct HeavyBlock {
  HeavyBlock(const Law& law, double gravity) : block(made_of(law, gravity)) {}

  AlignedBytes pack(const std::vector<SiteResult>* polynomials = nullptr) const {
    return write_pack({block.model, block.scene, block.sites, &linear, polynomials, false, {}, {}, &rest});
  }

  TouchedBlock block;
  Assembly assembly{block.model, block.model.fixed_dofs()};
  RestState rest = find_rest(assembly, block.scene);
  LinearDd linear = compute_linear_dd(assembly, block.sites, {}, rest);

 private:
  static TouchedBlock made_of(const Law& law, double gravity) {
    TouchedBlock block = touched_block(4, 0.26);
    block.model.materials.front().law = law;
    block.model.materials.front().density = 1.5;
    block.scene.gravity = gravity * Eigen::Vector3d(0.3, 0.1, -0.5);
    block.scene.gravity_may_turn = true;
    return block;
  }
};

// For a linear organ the response is exact for every direction of gravity. The reference takes u_g from a
// dense solve of its own and holds the contacts at their places.
class GravityOfALinearOrgan : public ::testing::Test {
 protected:
  static constexpr double kGravity = 0.02;

  Eigen::VectorXd sag(const Eigen::Vector3d& acceleration) const {
    Scene scene = heavy_.block.scene;
    scene.gravity = acceleration;
    scene.gravity_may_turn = false;
    return find_rest(heavy_.assembly, scene).displacement;
  }

  void expect_exact(const std::vector<pal_contact>& contacts, const std::vector<uint32_t>& fixed,
                    const Eigen::Vector3d& acceleration) {
    session_.fix(fixed);
    require(pal_session_set_gravity(session_.get(), acceleration.data()), "gravity");
    const auto results = session_.touch(contacts);
    const ContactSites& sites = heavy_.block.sites;
    const Eigen::VectorXd free = sag(acceleration);
    DenseReference::Held held;
    const auto hold = [&](int node, const Eigen::Vector3d& d) {
      held[node] = heavy_.rest.displacement.segment<3>(3 * node) + d - free.segment<3>(3 * node);
    };
    for (const pal_contact& contact : contacts) {
      for (const int node : sites.sites[contact.site].patch_nodes)
        hold(node, Eigen::Vector3d(contact.displacement));
    }
    for (const uint32_t node : fixed) hold(sites.model_node(static_cast<int>(node)), Eigen::Vector3d::Zero());
    const DenseReference::Answer truth = dense_.solve(held);
    for (size_t c = 0; c < contacts.size(); ++c) {
      Eigen::Vector3d force = Eigen::Vector3d::Zero();
      for (const int node : sites.sites[contacts[c].site].patch_nodes)
        force += truth.force.segment<3>(3 * node);
      EXPECT_LE((Eigen::Vector3d(results[c].force) - force).norm(), kForceTolerance * force.norm());
    }
    const Eigen::VectorXd expected = dense_.packed(truth.field + free);
    EXPECT_LE((as_vector(session_.field()) - expected).lpNorm<Eigen::Infinity>(),
              kFieldTolerance * expected.lpNorm<Eigen::Infinity>());
  }

  HeavyBlock heavy_{LinearElastic{3.0, 0.3}, kGravity};
  DenseReference dense_{heavy_.assembly, heavy_.block.sites};
  AlignedBytes bytes_ = heavy_.pack();
  OpenPack pack_{bytes_};
  OwnedSession session_{pack_.get(), PAL_MODEL_AUTO, 2, 4};
  const Eigen::Vector3d gravity_ = *heavy_.block.scene.gravity;
};

TEST_F(GravityOfALinearOrgan, IsExactHoweverItTurns) {
  const std::vector<pal_contact> two = {{0, {0.02, -0.01, -0.03}, 0, {}, {}, {}},
                                        {8, {0, 0.02, -0.01}, 0, {}, {}, {}}};
  for (const Eigen::Vector3d& acceleration :
       {gravity_, Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(-gravity_), Eigen::Vector3d(0.01, 0.03, 0.02)}) {
    SCOPED_TRACE(acceleration.transpose());
    expect_exact({{1, {0, 0, 0}, 0, {}, {}, {}}}, {}, acceleration);
    expect_exact(two, {}, acceleration);
    expect_exact({two[1]}, {0, 1}, acceleration);
  }
}

TEST_F(GravityOfALinearOrgan, TurnsForContactsBetweenSites) {
  OwnedSession at_sites(pack_.get(), PAL_MODEL_AUTO, 2, 4);
  const std::vector<pal_contact> contacts = {{0, {0.02, -0.01, -0.03}, 0, {}, {1, 3}, {0.3, 0.5}},
                                             {8, {0, 0.02, -0.01}, 0, {}, {7, 4}, {0.6, 0.1}}};
  const Eigen::Vector3d turned(0.01, 0.03, 0.02);
  for (OwnedSession* session : {&session_, &at_sites})
    require(pal_session_set_gravity(session->get(), turned.data()), "gravity");
  for (size_t count = 1; count <= 2; ++count) {
    const std::vector<pal_contact> some(contacts.begin(), contacts.begin() + static_cast<long>(count));
    const BlendedAnswers expected = blend_answers(at_sites, some);
    const auto results = session_.touch(some);
    EXPECT_NEAR(session_.get()->tissue.stored_energy, expected.energy,
                kForceTolerance * std::abs(expected.energy));
    for (size_t c = 0; c < count; ++c) {
      EXPECT_EQ(results[c].flags & PAL_FLAG_NEAREST_SITE, 0U);
      EXPECT_LE((Eigen::Vector3d(results[c].force) - expected.forces[c]).norm(),
                kForceTolerance * expected.forces[c].norm());
    }
    EXPECT_LE((as_vector(session_.field()) - expected.field).lpNorm<Eigen::Infinity>(),
              kFieldTolerance * expected.field.lpNorm<Eigen::Infinity>());
  }
}

TEST_F(GravityOfALinearOrgan, RestIsWhereThePackSays) {
  const Eigen::VectorXd expected = dense_.packed(heavy_.rest.displacement);
  EXPECT_GT(expected.lpNorm<Eigen::Infinity>(), 1e-3);
  EXPECT_LE((as_vector(session_.field()) - expected).lpNorm<Eigen::Infinity>(), 1e-7);
  const pal_geometry geometry = pack_.face().geometry();
  using Vector = Eigen::Map<const Eigen::VectorXd>;
  EXPECT_LE((Vector(geometry.rest_positions, expected.size()) - Vector(geometry.positions, expected.size()) -
             expected)
                .lpNorm<Eigen::Infinity>(),
            1e-15);
  const pal_pack_info info = pack_.info();
  EXPECT_EQ(info.has_gravity, 1U);
  EXPECT_EQ(info.gravity_may_turn, 1U);
  EXPECT_EQ(Eigen::Vector3d(info.gravity), gravity_);
  // A tool touches the sagged surface: there lies the site's position at rest.
  const Eigen::Vector3d place =
      heavy_.block.model.positions[static_cast<size_t>(heavy_.block.sites.sites[1].node)] +
      heavy_.rest.displacement.segment<3>(3 * heavy_.block.sites.sites[1].node);
  pal_surface_point point = {};
  require(pal_pack_find_surface_point(pack_.get(), place.data(), &point), "surface point");
  EXPECT_LE(std::abs(point.distance), 1e-6);
}

// A contact held in place carries the tissue's weight. A free contact sags with the field.
TEST_F(GravityOfALinearOrgan, AFreeContactFollows) {
  const Eigen::Vector3d turned(0.02, 0, 0.01);
  require(pal_session_set_gravity(session_.get(), turned.data()), "gravity");
  const pal_contact free = {1, {}, 7, {}, {}, {}};
  const auto result = session_.touch({free}).front();
  const auto held = session_.touch({{1, {}, 0, {}, {}, {}}}).front();
  EXPECT_LE(Eigen::Vector3d(result.force).norm(), 1e-9 * Eigen::Vector3d(held.force).norm());
  const auto moved =
      session_
          .touch(
              {{1, {result.displacement[0], result.displacement[1], result.displacement[2]}, 0, {}, {}, {}}})
          .front();
  EXPECT_LE(Eigen::Vector3d(moved.force).norm(), 1e-9 * Eigen::Vector3d(held.force).norm());
}

TEST_F(GravityOfALinearOrgan, OrgansAndTheirUnitsMayStandAnywhere) {
  const Eigen::Vector3d turned(0.02, 0, 0.01);
  const pal_contact contact = {1, {0.01, 0, -0.02}, 0, {}, {}, {}};
  require(pal_session_set_gravity(session_.get(), turned.data()), "gravity");
  const Eigen::Vector3d expected(session_.touch({contact}).front().force);
  Scene scene = heavy_.block.scene;
  scene.length_unit = "mm";
  scene.force_unit = "mN";
  scene.metres_per_length_unit = scene.newtons_per_force_unit = 1e-3;
  const AlignedBytes bytes = write_pack(
      {heavy_.block.model, scene, heavy_.block.sites, &heavy_.linear, nullptr, 0, {}, {}, &heavy_.rest});
  const OpenPack pack(bytes);
  pal_session_config config = session_config(pack.get(), PAL_MODEL_AUTO, 1, 0);
  const Eigen::Matrix3d rotation = rotation_vector({0.4, -1.1, 0.3});
  config.organ = pose_of({1, 2, 3}, rotation);
  OwnedSession session(pack.get(), config);
  const Eigen::Vector3d world = 1e-3 * (rotation * turned);
  require(pal_session_set_gravity(session.get(), world.data()), "gravity");
  pal_contact in_metres = contact;
  for (double& component : in_metres.displacement) component *= 1e-3;
  EXPECT_LE((1e3 * Eigen::Vector3d(session.touch({in_metres}).front().force) - expected).norm(),
            1e-9 * expected.norm());
  const Eigen::Vector3d scenes = 1e-3 * (rotation * gravity_);
  require(pal_session_set_gravity(session.get(), scenes.data()), "gravity");
  const auto as_in_the_scene = session.touch({in_metres}).front();
  require(pal_session_set_gravity(session.get(), nullptr), "gravity");
  EXPECT_EQ(Eigen::Vector3d(session.touch({in_metres}).front().force),
            Eigen::Vector3d(as_in_the_scene.force));
}

TEST_F(GravityOfALinearOrgan, NonsenseIsRefused) {
  const auto status = [&](double x, double y, double z) {
    const double acceleration[3] = {x, y, z};
    return pal_session_set_gravity(session_.get(), acceleration);
  };
  EXPECT_EQ(status(0, std::nan(""), 0), PAL_STATUS_NOT_FINITE);
  EXPECT_EQ(status(0, 0, 11 * gravity_.norm()), PAL_STATUS_BAD_ARGUMENT);
  EXPECT_EQ(status(0, 0, 1e308), PAL_STATUS_BAD_ARGUMENT);
  EXPECT_EQ(status(0, 0, 9 * gravity_.norm()), PAL_STATUS_OK);
  EXPECT_EQ(pal_session_set_gravity(nullptr, nullptr), PAL_STATUS_NULL_ARGUMENT);
  Scene scene = heavy_.block.scene;
  scene.gravity_may_turn = false;
  RestState still = heavy_.rest;
  still.per_gravity.resize(0, 0);
  const AlignedBytes bytes =
      write_pack({heavy_.block.model, scene, heavy_.block.sites, &heavy_.linear, nullptr, 0, {}, {}, &still});
  const OpenPack pack(bytes);
  OwnedSession session(pack.get(), PAL_MODEL_AUTO, 1, 0);
  EXPECT_EQ(pal_session_set_gravity(session.get(), nullptr), PAL_STATUS_NO_SUCH_MODEL);
  EXPECT_EQ(pack.info().has_gravity, 1U);
}

TEST_F(GravityOfALinearOrgan, DamageIsRefused) {
  const pack::Gravity& gravity = *pack::GetPack(bytes_.bytes().data() + sizeof(pack::PackHeader))->gravity();
  const auto status_with = [&](const pack::Segment& segment, const void* value, size_t size) {
    AlignedBytes changed(bytes_.bytes().size());
    std::copy(bytes_.bytes().begin(), bytes_.bytes().end(), changed.bytes().begin());
    std::memcpy(changed.bytes().data() + segment.offset(), value, size);
    alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES];
    pal_pack* pack = nullptr;
    return pal_pack_open_memory(changed.bytes().data(), changed.bytes().size(), PAL_VERIFY_ONCE, storage,
                                sizeof storage, &pack);
  };
  const double none[3] = {0, 0, 0};
  const double huge = 1e300;
  const double not_a_number = std::nan("");
  const auto infinite = std::numeric_limits<pal_real>::infinity();
  EXPECT_EQ(status_with(*gravity.acceleration(), gravity_.data(), sizeof none), PAL_STATUS_OK);
  EXPECT_EQ(status_with(*gravity.acceleration(), none, sizeof none), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with(*gravity.acceleration(), &huge, sizeof huge), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with(*gravity.rest_positions(), &not_a_number, sizeof huge), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with(*gravity.contact_per_gravity(), &huge, sizeof huge), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with(*gravity.field_per_gravity(), &infinite, sizeof infinite),
            PAL_STATUS_CORRUPT_CONTENT);
}

// Fixed nodes keep their positions, with or without contacts.
TEST_F(GravityOfALinearOrgan, HoldsFixedNodesWithoutContacts) {
  session_.fix({0, 1});
  const Eigen::Vector3d turned = -gravity_;
  require(pal_session_set_gravity(session_.get(), turned.data()), "gravity");
  session_.touch({});
  const Eigen::VectorXd rest = dense_.packed(heavy_.rest.displacement);
  const Eigen::VectorXd moved = as_vector(session_.field()) - rest;
  EXPECT_GT(moved.lpNorm<Eigen::Infinity>(), 1e-3);
  for (const Eigen::Index node : {0, 1}) {
    EXPECT_LE(moved.segment<3>(3 * heavy_.block.sites.contact_nodes[static_cast<size_t>(node)]).norm(),
              kFieldTolerance * moved.lpNorm<Eigen::Infinity>());
  }
}

// Setting the same gravity again in every frame gives a tool no energy. Nodes fixed at depth stiffen the
// tissue before the tool leaves.
TEST_F(GravityOfALinearOrgan, SayingItAgainGivesNoEnergy) {
  for (const bool says : {false, true}) {
    pal_session_config config = session_config(pack_.get(), PAL_MODEL_AUTO, 1, 4);
    config.blend_seconds = 0.01;
    ToolSession tools(pack_.get(), config);
    constexpr int kFrames = 200;
    constexpr double kDepth = 0.05;
    double work = 0;
    double most = 0;
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    double depth_before = 0;
    tools.hold(0, pal_default_hold(4));
    for (int frame = 0; frame <= 2 * kFrames; ++frame) {
      if (says) require(pal_session_set_gravity(tools.get(), gravity_.data()), "gravity");
      if (frame == kFrames) tools.fix({0, 1, 2});
      const double depth = kDepth * (1 - std::abs(frame - kFrames) / static_cast<double>(kFrames));
      const Eigen::Vector3d force = force_of(tools.frame({at({0, 0, -depth})}).front());
      work += 0.5 * (force + before)[2] * (depth_before - depth);
      most = std::max(most, work);
      before = force;
      depth_before = depth;
    }
    EXPECT_GT(most, 0);
    EXPECT_GE(work, -0.01 * most) << says;
  }
}

// Energy from gravity does not count as energy from a tool: no force is reduced.
TEST_F(GravityOfALinearOrgan, TurningItIsNotHeldAgainstTools) {
  ToolSession tools(pack_.get(), session_config(pack_.get(), PAL_MODEL_AUTO, 1, 0));
  tools.hold(0, pal_default_hold(1));
  for (int frame = 0; frame < 400; ++frame) {
    const double angle = 0.05 * frame;
    const Eigen::Vector3d turned = gravity_.norm() * Eigen::Vector3d(std::cos(angle), 0, std::sin(angle));
    require(pal_session_set_gravity(tools.get(), turned.data()), "gravity");
    const auto result = tools.frame({at({0, 0, -0.01 * std::sin(0.1 * frame)})}).front();
    EXPECT_EQ(result.flags & PAL_FLAG_REDUCED, 0U) << frame;
    EXPECT_TRUE(force_of(result).allFinite());
  }
}

TEST_F(GravityOfALinearOrgan, IsRecorded) {
  std::vector<uint64_t> buffer(4096);
  OwnedSession session(pack_.get(), PAL_MODEL_AUTO, 1, 0);
  require(pal_session_record(session.get(), buffer.data(), buffer.size() * 8), "record");
  const pal_contact contact = {1, {0.01, 0, -0.02}, 0, {}, {}, {}};
  const Eigen::Vector3d turned(0.02, 0, 0.01);
  require(pal_session_set_gravity(session.get(), turned.data()), "gravity");
  session.touch({contact});
  require(pal_session_set_gravity(session.get(), nullptr), "gravity");
  session.touch({contact});
  size_t bytes = 0;
  require(pal_session_stop_recording(session.get(), &bytes, nullptr), "stop");
  OwnedSession again(pack_.get(), PAL_MODEL_AUTO, 1, 0);
  pal_replay replay = {};
  replay.struct_size = sizeof replay;
  int calls = 0;
  for (; replay.ended == 0; ++calls) {
    require(pal_session_replay(again.get(), buffer.data(), bytes, &replay), "replay");
    EXPECT_EQ(replay.diverged, 0U) << calls;
  }
  EXPECT_EQ(calls, 4);
}

// A nonlinear organ: contacts start from the sagged equilibrium, to first order in linear_dd. Polynomials are
// as accurate as without gravity.
TEST(GravityOfANonlinearOrgan, ContactsAreAnsweredFromItsRest) {
  const HeavyBlock heavy(CompressibleNeoHookean{0.48, 0.2}, 0.3);
  EXPECT_GT(heavy.rest.displacement.lpNorm<Eigen::Infinity>(), 0.05) << "else nothing is shown";
  SamplingPlan plan;
  plan.survey_samples = 4;
  const std::vector<SiteResult> results =
      sample_sites(heavy.assembly, heavy.block.scene, heavy.block.sites, heavy.linear, plan, {}, heavy.rest);
  const AlignedBytes bytes = heavy.pack(&results);
  const OpenPack pack(bytes);
  OwnedSession nonlinear(pack.get(), PAL_MODEL_POLYNOMIAL, 1, 0);
  OwnedSession linear(pack.get(), PAL_MODEL_LINEAR, 1, 0);
  const Eigen::VectorXd rest = packed_rows(heavy.block.sites, heavy.rest.displacement);
  StaticSolver solver(heavy.assembly);
  const auto truth_at = [&](uint32_t site, const Eigen::Vector3d& d) {
    SiteSampler sampler(solver, heavy.block.sites, heavy.block.sites.sites[site], heavy.rest);
    Sample truth;
    EXPECT_TRUE(sampler.solve_from_rest(d, 1, truth));
    return truth;
  };
  const auto error_of = [&](OwnedSession& session, uint32_t site, const Eigen::Vector3d& d) {
    const Sample truth = truth_at(site, d);
    const auto result = session.touch({{site, {d[0], d[1], d[2]}, 0, {}, {}, {}}}).front();
    EXPECT_LE((Eigen::Vector3d(result.force) - truth.force).norm(), 0.1 * truth.force.norm());
    return (as_vector(session.field()) - rest - truth.field).lpNorm<Eigen::Infinity>() / d.norm();
  };
  const Eigen::Vector3d d(0.05, 0.02, -0.08);
  EXPECT_LE(error_of(nonlinear, 2, d), 0.01);
  EXPECT_GT(error_of(linear, 2, d), 0.01);
  EXPECT_LE(error_of(linear, 2, 1e-3 * d), 1e-3);
  // A push far smaller than the sag keeps its digits, also where storage rounds the sample.
  SiteSampler sampler(solver, heavy.block.sites, heavy.block.sites.sites[2], heavy.rest);
  Sample small;
  ASSERT_EQ(sampler.solve(1e-4 * d, small), PushOutcome::solved);
  const Sample small_truth = truth_at(2, 1e-4 * d);
  EXPECT_LE((small.field - small_truth.field).norm(), 1e-6 * small_truth.field.norm());
  // The energy is the work done: its gradient is the force.
  const Sample truth = truth_at(2, d);
  constexpr double kStep = 1e-5;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
    EXPECT_NEAR((truth_at(2, d + step).energy - truth_at(2, d - step).energy) / (2 * kStep),
                truth.force[axis], 1e-6 * truth.force.norm());
  }
  // Polynomials hold only for the scene's gravity; linear_dd answers when gravity turns.
  EXPECT_EQ(pal_session_set_gravity(nonlinear.get(), Eigen::Vector3d(0, 0, 0.1).eval().data()),
            PAL_STATUS_MODEL_CANNOT_ANSWER);
  OwnedSession automatic(pack.get(), PAL_MODEL_AUTO, 1, 0);
  const pal_contact contact = {2, {0.01, 0, -0.02}, 0, {}, {}, {}};
  EXPECT_EQ(automatic.touch({contact}).front().model, PAL_MODEL_POLYNOMIAL);
  const Eigen::Vector3d turned(0, 0.05, 0.1);
  require(pal_session_set_gravity(automatic.get(), turned.data()), "gravity");
  EXPECT_EQ(automatic.touch({contact}).front().model, PAL_MODEL_LINEAR);
  require(pal_session_set_gravity(automatic.get(), nullptr), "gravity");
  EXPECT_EQ(automatic.touch({contact}).front().model, PAL_MODEL_POLYNOMIAL);
}

// St. Venant-Kirchhoff's law collapses under this weight.
TEST(GravityRest, TooMuchIsSaid) {
  TouchedBlock block = touched_block(2, 0.4);
  block.model.materials.front().law = StVenantKirchhoff{0.48, 0.2};
  block.model.materials.front().density = 1;
  block.scene.gravity = Eigen::Vector3d(0, 0, -100);
  const Assembly assembly(block.model, block.model.fixed_dofs());
  EXPECT_THROW(find_rest(assembly, block.scene), std::runtime_error);
}

}  // namespace gravity_test
}  // namespace palpate::test
