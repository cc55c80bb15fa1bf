// A visual frame on its own thread sees whole haptic frames, without a data race.
#include <gtest/gtest.h>

#include "tests/support/runtime_session.hpp"
#include "tests/support/shell_command.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace snapshot_test {

TEST(Snapshot, TheFieldIsThatOfTheLastHapticFrame) {
  const OpenPack pack(small_pack_bytes());
  OwnedSession session(pack.get(), PAL_MODEL_AUTO);
  const std::vector<pal_real> rest = session.field();
  session.touch({{0, {0, 0, -0.02}, 0, {}, {}, {}}});
  session.touch({{0, {0, 0, -0.04}, 0, {}, {}, {}}});  // two haptic frames to each visual frame
  OwnedSession only_last(pack.get(), PAL_MODEL_AUTO);
  only_last.touch({{0, {0, 0, -0.04}, 0, {}, {}, {}}});
  const std::vector<pal_real> pushed = session.field();
  EXPECT_EQ(pushed, only_last.field());
  EXPECT_NE(pushed, rest);
  EXPECT_EQ(session.field(), pushed) << "two visual frames to one haptic";
  session.touch({});
  EXPECT_EQ(session.field(), rest);
}

TEST(Snapshot, ARefusedFrameLeavesTheFieldAlone) {
  const OpenPack pack(small_pack_bytes());
  OwnedSession session(pack.get(), PAL_MODEL_AUTO);
  session.touch({{0, {0, 0, -0.04}, 0, {}, {}, {}}});
  const std::vector<pal_real> before = session.field();
  const pal_contact nowhere = {pack.info().num_sites, {0, 0, 0.01}, 0, {}, {}, {}};
  ASSERT_EQ(pal_contact_frame(session.get(), &nowhere, 1, nullptr), PAL_STATUS_NO_SUCH_SITE);
  EXPECT_EQ(session.field(), before);
}

#ifdef PALPATE_SNAPSHOT_THREADS
CommandResult run_threads(const std::string& more, const AlignedBytes& of_pack = small_pack_bytes()) {
  const TempDir dir;
  const auto bytes = of_pack.bytes();
  const auto pack = dir.write("block.pack", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return run_command(shell_word(PALPATE_SNAPSHOT_THREADS) + " " + shell_word(pack.string()) + more);
}

// Some kernels spread addresses wider than ThreadSanitizer expects.
bool sanitizer_cannot_run(const CommandResult& run) {
  return run.output.find("unexpected memory mapping") != std::string::npos;
}

TEST(Snapshot, OneReaderBesideTheHapticThreadIsNoRace) {
  const CommandResult run = run_threads("");
  if (sanitizer_cannot_run(run)) GTEST_SKIP() << run.output;
  EXPECT_EQ(run.exit_code, 0) << run.output;
}

TEST(Snapshot, OneRefinerBesideTheHapticThreadIsNoRace) {
  const CommandResult run = run_threads(" refine", zone_pack_bytes());
  if (sanitizer_cannot_run(run)) GTEST_SKIP() << run.output;
  EXPECT_EQ(run.exit_code, 0) << run.output;
}

TEST(Snapshot, TwoRefinersAreARaceAndAreFound) {
  const CommandResult run = run_threads(" two-refiners", zone_pack_bytes());
  if (sanitizer_cannot_run(run)) GTEST_SKIP() << run.output;
  EXPECT_EQ(run.exit_code, 66) << run.output;
}

TEST(Snapshot, TwoReadersAreARaceAndAreFound) {
  const CommandResult run = run_threads(" two-readers");
  if (sanitizer_cannot_run(run)) GTEST_SKIP() << run.output;
  EXPECT_EQ(run.exit_code, 66) << run.output;
  EXPECT_NE(run.output.find("data race"), std::string::npos) << run.output;
}
#endif

}  // namespace snapshot_test
}  // namespace palpate::test
