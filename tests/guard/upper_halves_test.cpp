// Frames clear the upper halves of vector registers (vzeroupper). Dirty upper halves slow down later SSE
// code, in the next frame and in the host, until a vzeroupper. GCC inserts vzeroupper from -O2 on, but not
// with -Os.
#include <gtest/gtest.h>

#include <string>

#include "runtime/src/numerics/field_kernel.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace palpate::test {
namespace upper_halves_test {

#if defined(__x86_64__)
// Whether XGETBV with ECX = 1 reports the registers in use on this processor, and reports them truly.
bool tells_registers_in_use() {
  uint32_t a = 0;
  uint32_t b = 0;
  uint32_t c = 0;
  uint32_t d = 0;
  constexpr uint32_t kXgetbv1 = 1U << 2;
  return __builtin_cpu_supports("avx2") && __get_cpuid_count(0xd, 1, &a, &b, &c, &d) != 0 &&
         (a & kXgetbv1) != 0;
}

bool upper_halves_in_use() {
  uint32_t low = 0;
  uint32_t high = 0;
  asm volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(1));
  constexpr uint32_t kOf256 = 1U << 2;
  constexpr uint32_t kOf512 = 1U << 6;
  return (low & (kOf256 | kOf512)) != 0;
}

void set_upper_halves() {
  asm volatile("vpcmpeqd %%ymm1, %%ymm1, %%ymm1" ::: "xmm1");
}
void clear_upper_halves() {
  asm volatile("vzeroupper");
}
#else
bool tells_registers_in_use() {
  return false;
}
bool upper_halves_in_use() {
  return false;
}
void set_upper_halves() {}
void clear_upper_halves() {}
#endif

class UpperHalves : public ::testing::Test {
 protected:
  void SetUp() override {
#if !defined(NDEBUG) || defined(__OPTIMIZE_SIZE__)
    GTEST_SKIP() << "of a release build";
#endif
    if (!tells_registers_in_use()) GTEST_SKIP() << "this processor does not tell";
    clear_upper_halves();
    if (upper_halves_in_use()) GTEST_SKIP() << "this processor tells too much";
  }

  template <typename Call>
  static void expect_clear_after(const std::string& what, Call&& call) {
    clear_upper_halves();
    call();
    const bool in_use = upper_halves_in_use();
    clear_upper_halves();
    EXPECT_FALSE(in_use) << what;
  }
};

// Breaks the guard on purpose.
TEST_F(UpperHalves, SetHalvesAreSeen) {
  set_upper_halves();
  const bool in_use = upper_halves_in_use();
  clear_upper_halves();
  EXPECT_TRUE(in_use);
}

TEST_F(UpperHalves, ClearAfterEveryFieldKernel) {
  FieldKernel kernels[kMostFieldKernels];
  const uint32_t count = list_field_kernels(kernels);
  alignas(64) const pal_real columns[4 * pack::kPanelRows] = {1};
  alignas(64) const int16_t rounded_columns[pack::rounded_panel_numbers(5)] = {1};
  const pal_real weights[4] = {1, 2, 3, 4};
  const RoundedWeights rounded = {pack::num_column_pairs(5), 1, 1, {1, 2, 3}};
  alignas(64) pal_real sum[pack::kPanelRows] = {};
  for (uint32_t k = 0; k < count; ++k) {
    const std::string name = kernels[k].name;
    expect_clear_after(name + " columns",
                       [&] { kernels[k].add_columns(columns, pack::kPanelRows, weights, 4, true, sum); });
    expect_clear_after(name + " rounded",
                       [&] { kernels[k].add_rounded(rounded_columns, rounded, true, sum); });
  }
}

// All models, one and several contacts, fixed nodes, fields with both kinds of columns.
TEST_F(UpperHalves, ClearAfterEveryFrame) {
  int answered = 0;
  for (const AlignedBytes* bytes : {&zone_pack_bytes(), &rounded_pack_bytes()}) {
    const OpenPack pack(*bytes);
    const pal_pack_info info = pack.info();
    std::vector<pal_real> field(size_t{3} * info.num_nodes);
    for (const pal_model model : {PAL_MODEL_AUTO, PAL_MODEL_LINEAR, PAL_MODEL_POLYNOMIAL, PAL_MODEL_ZONE}) {
      if (model == PAL_MODEL_ZONE && info.zone_rings == 0) continue;
      OwnedSession session(pack.get(), model, 3, 4);
      const bool is_for_one = model == PAL_MODEL_POLYNOMIAL;
      for (uint32_t frame = 0; frame < 60; ++frame) {
        SCOPED_TRACE(testing::Message() << "model " << model << ", frame " << frame);
        const uint32_t fixed[2] = {frame % info.num_contact_nodes, (frame + 7) % info.num_contact_nodes};
        pal_contact contacts[3];
        for (uint32_t c = 0; c < 3; ++c) {
          contacts[c] = {
              (frame / 3 + 5 * c) % info.num_sites, {1e-3 * frame, 0.01, -1e-4 * frame}, 0, {}, {}, {}};
        }
        pal_contact_result results[3];
        const uint32_t count = is_for_one ? 1 : 1 + frame % 3;
        const uint32_t num_fixed = is_for_one ? 0 : frame % 3;
        pal_status status = PAL_STATUS_OK;
        const auto expect_answer = [&](const char* what, auto&& call) {
          expect_clear_after(what, [&] { status = call(); });
          answered += status == PAL_STATUS_OK;
        };
        expect_answer("fixed", [&] { return pal_session_set_fixed(session.get(), fixed, num_fixed); });
        expect_answer("contacts", [&] { return pal_contact_frame(session.get(), contacts, count, results); });
        expect_answer("field", [&] { return pal_visual_frame(session.get(), field.data(), kNodeBytes); });
      }
    }
  }
  EXPECT_GT(answered, 1100);  // else few frames were answered
}

}  // namespace upper_halves_test
}  // namespace palpate::test
