// Any input: a bad input returns its documented status and touches no output; a good input gives finite
// numbers.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/support/runtime_session.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace runtime_inputs_test {

constexpr unsigned char kCanary = 0xa5;
const double kNan = std::numeric_limits<double>::quiet_NaN();
const double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHuge = std::numeric_limits<double>::max();
constexpr double kDenormal = std::numeric_limits<double>::denorm_min();

// An output with a pattern that shows a write.
template <typename T>
struct Watched {
  Watched() { std::memset(static_cast<void*>(&value), kCanary, sizeof value); }
  bool touched() const {
    unsigned char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof value);
    for (const unsigned char byte : bytes) {
      if (byte != kCanary) return true;
    }
    return false;
  }
  T value;
};

class RuntimeInputs : public ::testing::TestWithParam<pal_model> {
 protected:
  RuntimeInputs()
      : pack_(small_pack_bytes()),
        session_(pack_.get(), GetParam(), 3, GetParam() == PAL_MODEL_POLYNOMIAL ? 0 : 4) {}

  OpenPack pack_;
  OwnedSession session_;
};

std::string name_of(const ::testing::TestParamInfo<pal_model>& model) {
  return model.param == PAL_MODEL_AUTO ? "Auto" : model.param == PAL_MODEL_LINEAR ? "Linear" : "Polynomial";
}
INSTANTIATE_TEST_SUITE_P(Models, RuntimeInputs,
                         ::testing::Values(PAL_MODEL_AUTO, PAL_MODEL_LINEAR, PAL_MODEL_POLYNOMIAL), name_of);

TEST_P(RuntimeInputs, NotFiniteIsRefusedAndNothingChanges) {
  const pal_contact good = {3, {0.01, 0.02, -0.02}, 0, {}, {}, {}};
  session_.touch({good});
  const std::vector<pal_real> field = session_.field();
  for (const double bad : {kNan, -kNan, kInfinity, -kInfinity}) {
    for (int axis = 0; axis < 3; ++axis) {
      pal_contact contact = good;
      contact.displacement[axis] = bad;
      Watched<pal_contact_result> result;
      EXPECT_EQ(pal_contact_frame(session_.get(), &contact, 1, &result.value), PAL_STATUS_NOT_FINITE);
      EXPECT_FALSE(result.touched());
      EXPECT_EQ(session_.field(), field);
    }
  }
}

TEST_P(RuntimeInputs, AnyFiniteDisplacementIsAnsweredFinitely) {
  for (const double size :
       {kDenormal, -kDenormal, 1e-310, 1e-300, 1e-150, 1e-30, 1e30, 1e150, 1e300, kHuge, -kHuge}) {
    for (int axes = 1; axes < 8; ++axes) {
      const pal_contact contact = {
          5, {axes & 1 ? size : 0, axes & 2 ? -size : 0, axes & 4 ? size : 0}, 0, {}, {}, {}};
      const auto result = session_.touch({contact}).front();
      EXPECT_TRUE(all_finite(result)) << size;
      EXPECT_TRUE(all_finite(session_.field())) << size;
      const Eigen::Vector3d force(result.force);
      if (std::abs(size) > 1) {
        EXPECT_TRUE(result.flags & PAL_FLAG_CLAMPED) << size;
        EXPECT_TRUE(result.flags & PAL_FLAG_EXTRAPOLATED) << size;
        // The response is for the shortened displacement, not for zero.
        EXPECT_GT(force.norm(), 0) << size << " along axes " << axes;
        EXPECT_EQ(result.displacement_error, 1);
      } else {
        EXPECT_EQ(result.flags, 0U) << size;
        EXPECT_LE(force.norm(), 1e-25) << size;
      }
    }
  }
}

// Beyond the limit the response depends only on the direction.
TEST_P(RuntimeInputs, ClampedAnswerDependsOnTheDirectionAlone) {
  const auto force = [&](double size) {
    return Eigen::Vector3d(
        session_.touch({{5, {0.6 * size, -0.5 * size, 0.4 * size}, 0, {}, {}, {}}}).front().force);
  };
  const Eigen::Vector3d expected = force(1e12);
  for (const double size : {1e20, 1e155, 1e200, 1e300, 1e308, kHuge})
    EXPECT_LE((force(size) - expected).norm(), 1e-12 * expected.norm()) << size;
}

TEST_P(RuntimeInputs, UnknownSitesAndNodesAreRefused) {
  const uint32_t sites = pack_.info().num_sites;
  session_.touch({{sites - 1, {0, 0, -0.01}, 0, {}, {}, {}}});
  const std::vector<pal_real> field = session_.field();
  for (const uint32_t site : {sites, sites + 1, 0x7fffffffu, 0xffffffffu}) {
    const pal_contact contact = {site, {0, 0, -0.01}, 0, {}, {}, {}};
    Watched<pal_contact_result> result;
    EXPECT_EQ(pal_contact_frame(session_.get(), &contact, 1, &result.value), PAL_STATUS_NO_SUCH_SITE);
    EXPECT_FALSE(result.touched());
    Watched<uint32_t> node;
    EXPECT_EQ(pal_pack_get_site_node(pack_.get(), site, &node.value), PAL_STATUS_NO_SUCH_SITE);
    EXPECT_FALSE(node.touched());
  }
  if (GetParam() != PAL_MODEL_POLYNOMIAL) {
    for (const uint32_t node : {pack_.info().num_contact_nodes, 0xffffffffu}) {
      const uint32_t nodes[2] = {0, node};
      EXPECT_EQ(pal_session_set_fixed(session_.get(), nodes, 2), PAL_STATUS_NO_SUCH_NODE);
    }
  }
  EXPECT_EQ(session_.field(), field);
  Watched<uint32_t> found;
  for (const int32_t label :
       {-5, 0, 49, 1000, std::numeric_limits<int32_t>::max(), std::numeric_limits<int32_t>::min()}) {
    EXPECT_EQ(pal_pack_find_site(pack_.get(), label, &found.value), PAL_STATUS_NO_SUCH_SITE);
  }
  for (const int32_t label :
       {-5, 0, 1, 1000, std::numeric_limits<int32_t>::max(), std::numeric_limits<int32_t>::min()}) {
    EXPECT_EQ(pal_pack_find_contact_node(pack_.get(), label, &found.value), PAL_STATUS_NO_SUCH_NODE);
  }
  EXPECT_FALSE(found.touched());
}

TEST_P(RuntimeInputs, ModelThatCannotAnswerIsRefused) {
  session_.touch({{1, {0, 0, -0.01}, 0, {}, {}, {}}});
  const std::vector<pal_real> field = session_.field();
  const pal_contact contacts[2] = {{0, {0, 0, -0.01}, 0, {}, {}, {}}, {5, {0, 0, -0.01}, 0, {}, {}, {}}};
  const bool can = GetParam() != PAL_MODEL_POLYNOMIAL;
  EXPECT_EQ(pal_contact_frame(session_.get(), contacts, 2, nullptr),
            can ? PAL_STATUS_OK : PAL_STATUS_MODEL_CANNOT_ANSWER);
  EXPECT_EQ(session_.field() == field, !can);
}

TEST_P(RuntimeInputs, ResultsMayBeNull) {
  const std::vector<pal_contact> contacts = {{3, {0.01, 0.02, -0.02}, 0, {}, {}, {}}};
  session_.touch(contacts);
  const std::vector<pal_real> field = session_.field();
  session_.touch({{7, {0.01, 0.02, -0.02}, 0, {}, {}, {}}});
  EXPECT_EQ(pal_contact_frame(session_.get(), contacts.data(), 1, nullptr), PAL_STATUS_OK);
  EXPECT_EQ(session_.field(), field);
}

TEST_P(RuntimeInputs, NoContactsIsRest) {
  session_.touch({{3, {0.01, 0.02, -0.02}, 0, {}, {}, {}}});
  const pal_contact unread = {99, {kNan, 0, 0}, 0, {}, {}, {}};
  Watched<pal_contact_result> result;
  EXPECT_EQ(pal_contact_frame(session_.get(), &unread, 0, &result.value), PAL_STATUS_OK);
  EXPECT_FALSE(result.touched());
  for (const pal_real value : session_.field()) EXPECT_EQ(value, 0.0f);
}

TEST_P(RuntimeInputs, FieldIsRestBeforeTheFirstFrame) {
  for (const pal_real value : session_.field()) EXPECT_EQ(value, 0.0f);
}

TEST_P(RuntimeInputs, StridesWriteTheirThreeNumbersAndNoMore) {
  session_.touch({{3, {0.01, 0.02, -0.02}, 0, {}, {}, {}}});
  const std::vector<pal_real> field = session_.field();
  const uint32_t nodes = pack_.info().num_nodes;
  for (const size_t stride : {kNodeBytes, kNodeBytes + 1, kNodeBytes + 4, 2 * kNodeBytes, size_t{100}}) {
    std::vector<unsigned char> buffer(stride * nodes + 64, kCanary);
    // An odd stride misaligns floats: the runtime must write bytes.
    ASSERT_EQ(pal_visual_frame(session_.get(), reinterpret_cast<pal_real*>(buffer.data()), stride),
              PAL_STATUS_OK);
    for (size_t i = 0; i < nodes; ++i) {
      pal_real written[3];
      std::memcpy(written, buffer.data() + i * stride, sizeof written);
      for (size_t axis = 0; axis < 3; ++axis) EXPECT_EQ(written[axis], field[3 * i + axis]) << "node " << i;
      for (size_t byte = kNodeBytes; byte < stride; ++byte) ASSERT_EQ(buffer[i * stride + byte], kCanary);
    }
    for (size_t byte = stride * nodes; byte < buffer.size(); ++byte) ASSERT_EQ(buffer[byte], kCanary);
  }
  Watched<pal_real> out;
  for (const size_t stride : {size_t{0}, size_t{4}, kNodeBytes - 1})
    EXPECT_EQ(pal_visual_frame(session_.get(), &out.value, stride), PAL_STATUS_BAD_ARGUMENT);
  EXPECT_FALSE(out.touched());
}

TEST_P(RuntimeInputs, RequestedNodesAreThoseOfTheWholeField) {
  pal_session_config config = session_config(pack_.get(), GetParam(), 1, 0);
  config.max_requested = 10;
  OwnedSession session(pack_.get(), config);
  session.touch({{3, {0.01, 0.02, -0.02}, 0, {}, {}, {}}});
  const std::vector<pal_real> all = session.field();
  const uint32_t nodes = pack_.info().num_nodes;
  for (const std::vector<uint32_t>& asked :
       {std::vector<uint32_t>{0}, {nodes - 1}, {0, 1, 2}, {3, 31, 32, 33, nodes - 1}}) {
    ASSERT_EQ(pal_session_request_nodes(session.get(), asked.data(), static_cast<uint32_t>(asked.size())),
              PAL_STATUS_OK);
    std::vector<pal_real> some(3 * asked.size() + 3, 7.0f);
    ASSERT_EQ(pal_visual_frame(session.get(), some.data(), kNodeBytes), PAL_STATUS_OK);
    for (size_t i = 0; i < asked.size(); ++i)
      EXPECT_EQ(std::memcmp(&some[3 * i], &all[3 * asked[i]], kNodeBytes), 0) << "node " << asked[i];
    EXPECT_EQ(some.back(), 7.0f) << "no more than was asked for";
  }
  const uint32_t wrong[3] = {2, 2, nodes};
  EXPECT_EQ(pal_session_request_nodes(session.get(), wrong, 2), PAL_STATUS_BAD_ARGUMENT);
  EXPECT_EQ(pal_session_request_nodes(session.get(), wrong + 2, 1), PAL_STATUS_NO_SUCH_NODE);
  EXPECT_EQ(pal_session_request_nodes(session.get(), wrong, 11), PAL_STATUS_CAPACITY_EXCEEDED);
  EXPECT_EQ(pal_session_request_nodes(session.get(), nullptr, 1), PAL_STATUS_NULL_ARGUMENT);
  EXPECT_EQ(pal_session_request_nodes(session.get(), nullptr, 0), PAL_STATUS_OK);
  EXPECT_EQ(session.field(), all);
  config.max_requested = nodes + 1;
  size_t bytes = 0;
  EXPECT_EQ(pal_session_required_bytes(pack_.get(), &config, &bytes), PAL_STATUS_BAD_ARGUMENT);
}

TEST_P(RuntimeInputs, NullIsRefusedEverywhere) {
  const pal_status null = PAL_STATUS_NULL_ARGUMENT;
  const auto bytes = small_pack_bytes().bytes();
  alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES];
  Watched<pal_pack*> opened;
  EXPECT_EQ(pal_pack_open(nullptr, PAL_VERIFY_ONCE, storage, sizeof storage, &opened.value), null);
  EXPECT_EQ(pal_pack_open("x", PAL_VERIFY_ONCE, nullptr, sizeof storage, &opened.value), null);
  EXPECT_EQ(pal_pack_open("x", PAL_VERIFY_ONCE, storage, sizeof storage, nullptr), null);
  EXPECT_EQ(
      pal_pack_open_memory(nullptr, bytes.size(), PAL_VERIFY_ONCE, storage, sizeof storage, &opened.value),
      null);
  EXPECT_EQ(pal_pack_open_memory(bytes.data(), bytes.size(), PAL_VERIFY_ONCE, nullptr, sizeof storage,
                                 &opened.value),
            null);
  EXPECT_EQ(
      pal_pack_open_memory(bytes.data(), bytes.size(), PAL_VERIFY_ONCE, storage, sizeof storage, nullptr),
      null);
  EXPECT_FALSE(opened.touched());
  pal_pack_close(nullptr);

  const pal_pack* pack = pack_.get();
  Watched<pal_pack_info> info;
  info.value.struct_size = sizeof(pal_pack_info);
  pal_geometry geometry = {};
  geometry.struct_size = sizeof geometry;
  Watched<uint32_t> index;
  Watched<const void*> place;
  Watched<size_t> size;
  EXPECT_EQ(pal_pack_get_info(nullptr, &info.value), null);
  EXPECT_EQ(pal_pack_get_info(pack, nullptr), null);
  EXPECT_EQ(pal_pack_get_geometry(nullptr, &geometry), null);
  EXPECT_EQ(pal_pack_get_geometry(pack, nullptr), null);
  EXPECT_EQ(pal_pack_find_site(nullptr, 54, &index.value), null);
  EXPECT_EQ(pal_pack_find_site(pack, 54, nullptr), null);
  EXPECT_EQ(pal_pack_find_contact_node(nullptr, 54, &index.value), null);
  EXPECT_EQ(pal_pack_find_contact_node(pack, 54, nullptr), null);
  EXPECT_EQ(pal_pack_get_site_node(nullptr, 0, &index.value), null);
  EXPECT_EQ(pal_pack_get_site_node(pack, 0, nullptr), null);
  EXPECT_EQ(pal_pack_get_bytes(nullptr, &place.value, &size.value), null);
  EXPECT_EQ(pal_pack_get_bytes(pack, nullptr, &size.value), null);
  EXPECT_EQ(pal_pack_get_bytes(pack, &place.value, nullptr), null);
  EXPECT_FALSE(index.touched() || place.touched() || size.touched());

  const pal_session_config config = pal_default_session_config(pack);
  EXPECT_EQ(pal_default_session_config(nullptr).max_contacts, 1U);
  EXPECT_EQ(pal_default_session_config(pack).max_contacts, 3U);
  EXPECT_EQ(pal_session_required_bytes(nullptr, &config, &size.value), null);
  EXPECT_EQ(pal_session_required_bytes(pack, nullptr, &size.value), null);
  EXPECT_EQ(pal_session_required_bytes(pack, &config, nullptr), null);
  EXPECT_FALSE(size.touched());
  alignas(64) unsigned char arena[64];
  Watched<pal_session*> session;
  EXPECT_EQ(pal_session_init(nullptr, &config, arena, sizeof arena, &session.value), null);
  EXPECT_EQ(pal_session_init(pack, nullptr, arena, sizeof arena, &session.value), null);
  EXPECT_EQ(pal_session_init(pack, &config, nullptr, sizeof arena, &session.value), null);
  EXPECT_EQ(pal_session_init(pack, &config, arena, sizeof arena, nullptr), null);
  EXPECT_FALSE(session.touched());

  const pal_contact contact = {0, {0, 0, 0}, 0, {}, {}, {}};
  Watched<pal_contact_result> result;
  Watched<pal_real> out;
  const uint32_t node = 0;
  EXPECT_EQ(pal_session_set_fixed(nullptr, &node, 1), null);
  EXPECT_EQ(pal_session_set_fixed(session_.get(), nullptr, 1), null);
  EXPECT_EQ(pal_session_set_fixed(session_.get(), nullptr, 0), PAL_STATUS_OK);
  EXPECT_EQ(pal_contact_frame(nullptr, &contact, 1, &result.value), null);
  EXPECT_EQ(pal_contact_frame(session_.get(), nullptr, 1, &result.value), null);
  EXPECT_EQ(pal_contact_frame(session_.get(), nullptr, 0, nullptr), PAL_STATUS_OK);
  EXPECT_EQ(pal_visual_frame(nullptr, &out.value, kNodeBytes), null);
  EXPECT_EQ(pal_visual_frame(session_.get(), nullptr, kNodeBytes), null);
  EXPECT_FALSE(result.touched() || out.touched());
}

TEST_P(RuntimeInputs, StructSizeMustBeKnown) {
  for (const uint32_t wrong : {0u, 4u, 0xffffffffu}) {
    Watched<pal_pack_info> info;
    info.value.struct_size = wrong;
    EXPECT_EQ(pal_pack_get_info(pack_.get(), &info.value), PAL_STATUS_BAD_STRUCT_SIZE);
    info.value.struct_size = 0xa5a5a5a5;
    EXPECT_FALSE(info.touched());
    Watched<pal_geometry> geometry;
    geometry.value.struct_size = wrong;
    EXPECT_EQ(pal_pack_get_geometry(pack_.get(), &geometry.value), PAL_STATUS_BAD_STRUCT_SIZE);
    geometry.value.struct_size = 0xa5a5a5a5;
    EXPECT_FALSE(geometry.touched());
    pal_session_config config = pal_default_session_config(pack_.get());
    config.struct_size = wrong;
    Watched<size_t> bytes;
    EXPECT_EQ(pal_session_required_bytes(pack_.get(), &config, &bytes.value), PAL_STATUS_BAD_STRUCT_SIZE);
    EXPECT_FALSE(bytes.touched());
  }
}

TEST_P(RuntimeInputs, ModelThatThePackLacksIsRefused) {
  const AlignedBytes bytes = GetParam() == PAL_MODEL_LINEAR ? small_pack().write_polynomial_only()
                                                            : small_pack().write_linear_only();
  const OpenPack pack(bytes);
  const pal_session_config config = session_config(pack.get(), GetParam(), 1, 0);
  Watched<size_t> required;
  if (GetParam() == PAL_MODEL_AUTO) {
    OwnedSession session(pack.get(), config);
    EXPECT_EQ(session.touch({{0, {0, 0, -0.01}, 0, {}, {}, {}}})[0].flags,
              0U);  // linear_dd is no fallback where it is the only model
  } else {
    EXPECT_EQ(pal_session_required_bytes(pack.get(), &config, &required.value), PAL_STATUS_NO_SUCH_MODEL);
    EXPECT_FALSE(required.touched());
  }
}

}  // namespace runtime_inputs_test
}  // namespace palpate::test
