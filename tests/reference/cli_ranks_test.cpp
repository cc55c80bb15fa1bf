// `palpate build` on the processes of an mpirun makes the bytes of a single process, also after a crash.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/support/scene_files.hpp"
#include "tests/support/shell_command.hpp"

namespace palpate::test {
namespace cli_ranks_test {

const std::string kTop =
    "[contact]\nsites = [19, 20, 21, 22, 23, 24, 25, 26, 27]\nmax_displacement = 0.02\ntip_radius = 0.13\n"
    "max_contacts = 2\n";

class RankBuild : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::string(PALPATE_MPIEXEC).empty()) GTEST_SKIP() << "configured without MPI";
  }
  // More processes than cores; as root, in a container, without a network.
  static std::string mpirun(int ranks) {
    return std::string("env OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 ") + PALPATE_MPIEXEC +
           " -n " + std::to_string(ranks) + " --oversubscribe --bind-to none ";
  }
  static std::string build(const SceneFiles& files) {
    return shell_word(PALPATE_PROGRAM) + " build " + shell_word(files.scene.string()) + " -o " +
           shell_word(shared(files).string()) + " --jobs 1";
  }
  static std::filesystem::path shared(const SceneFiles& files) { return files.dir.path() / "shared.pack"; }
};

TEST_F(RankBuild, MakesTheBytesOfOneProcess) {
  const SceneFiles files(kTop);
  const ProgramRun alone = files.build();
  ASSERT_EQ(alone.exit_code, 0) << alone.error;
  const CommandResult several = run_command(mpirun(3) + build(files));
  ASSERT_EQ(several.exit_code, 0) << several.output;
  EXPECT_EQ(file_text(shared(files)), file_text(files.pack));
  EXPECT_NE(several.output.find("threads of each of 3 processes"), std::string::npos) << several.output;
  EXPECT_EQ(several.output.find("wrote"), several.output.rfind("wrote")) << "one of them speaks";
  // Each solve ran once, on one of the processes.
  const auto solved = [](const std::string& output) {
    const size_t start = output.find("solved ");
    return output.substr(start, output.find(" factors", start) - start);
  };
  EXPECT_EQ(solved(several.output), solved(alone.out));
}

// Few sites are sampled. More surveys follow once all processes know which.
TEST_F(RankBuild, MakesTheBytesOfOneProcessWhereFewAreSampled) {
  const SceneFiles files(
      "[contact]\nsites = \"surface\"\nsampled = \"fewest\"\nmax_displacement = 0.06\ntip_radius = 0.13\n"
      "[accuracy]\ntarget = 0.004\n");
  const ProgramRun alone = files.build();
  ASSERT_EQ(alone.exit_code, 0) << alone.error;
  const CommandResult several = run_command(mpirun(3) + build(files));
  ASSERT_EQ(several.exit_code, 0) << several.output;
  EXPECT_EQ(file_text(shared(files)), file_text(files.pack));
  const auto solved = [](const std::string& output) {
    const size_t start = output.find("solved ");
    return output.substr(start, output.find(" equilibria", start) - start);
  };
  EXPECT_EQ(solved(several.output), solved(alone.out));
}

TEST_F(RankBuild, GoesOnWhereACrashLeftIt) {
  std::string labels = "181";  // all nodes on top of a block of five cells
  for (int label = 182; label <= 216; ++label) labels += ", " + std::to_string(label);
  const SceneFiles files("[contact]\nsites = [" + labels + "]\nmax_displacement = 0.02\ntip_radius = 0.06\n",
                         block_inp(5));
  ASSERT_EQ(files.build().exit_code, 0);
  // Killed as soon as a solve is stored: a sample takes about 20 KB.
  const std::string samples = shell_word(shared(files).string() + ".samples");
  run_command(mpirun(3) + build(files) + " & started=$!; while [ -z \"$(find " + samples +
              " -name '*.samples' -size +32k 2>/dev/null)\" ] && kill -0 $started 2>/dev/null; do sleep "
              "0.01; done; kill -KILL $started; wait");
  // Ranks notice the kill of their mpirun late; on a busy machine some end their build first.
  CommandResult again;
  for (int tries = 0; tries < 60 && again.exit_code != 0; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    again = run_command(mpirun(2) + build(files));
  }
  ASSERT_EQ(again.exit_code, 0) << again.output;
  EXPECT_EQ(again.output.find(" 0 of them taken from there"), std::string::npos) << again.output;
  EXPECT_EQ(file_text(shared(files)), file_text(files.pack));
}

TEST_F(RankBuild, EndsAllWhenOneFails) {
  const SceneFiles files("[contact]\nsites = [19, 99]\nmax_displacement = 0.02\n");
  const CommandResult failed = run_command(mpirun(3) + build(files));
  EXPECT_NE(failed.exit_code, 0);
  const size_t said = failed.output.find("block.toml:3:");
  ASSERT_NE(said, std::string::npos) << failed.output;
  EXPECT_EQ(failed.output.find("block.toml:3:", said + 1), std::string::npos) << failed.output;
}

}  // namespace cli_ranks_test
}  // namespace palpate::test
