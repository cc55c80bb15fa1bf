// A killed `palpate build`, its resumption, and a build that cannot write.
#include <gtest/gtest.h>

#include <sys/stat.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <string>
#include <thread>

#include "tests/support/scene_files.hpp"

namespace palpate::test {
namespace cli_interrupted_build_test {

// A build killed at any moment resumes and makes the same bytes.
TEST(Build, GoesOnAfterItWasKilled) {
  const SceneFiles files("[contact]\nsites = \"surface\"\nmax_displacement = 0.05\ntip_radius = 0.13\n",
                         block_inp(3));
  ASSERT_EQ(files.build().exit_code, 0);
  const std::string whole = file_text(files.pack);
  std::filesystem::remove_all(files.pack.string() + ".samples");
  const std::vector<std::string> command = {
      "build", files.scene.string(), "-o", files.pack.string(), "--jobs", "1", "--json"};
  ProgramProcess process(command);
  const auto kept = [&] {
    std::uintmax_t bytes = 0;
    std::error_code ignored;
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(files.pack.string() + ".samples", ignored))
      bytes += entry.is_regular_file() ? entry.file_size() : 0;
    return bytes;
  };
  while (kept() < 100000 && process.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  process.kill_now();
  ASSERT_EQ(process.finish().exit_code, -1) << "it was through before it was killed: make the scene larger";
  const ProgramRun resumed_run = run_program(command);
  ASSERT_EQ(resumed_run.exit_code, 0) << resumed_run.error;
  const nlohmann::json resumed = resumed_run.json();
  EXPECT_GT(resumed["reused"].get<int>(), 0);
  EXPECT_GT(resumed["solves"].get<int>(), 0);
  EXPECT_TRUE(file_text(files.pack) == whole);
  EXPECT_EQ(run_program(command).json()["solves"], 0);
  EXPECT_TRUE(file_text(files.pack) == whole);
}

TEST(Build, ReportsAnUnwritableStoreBeforeTheWork) {
  const SceneFiles files;
  const ProgramRun run = run_program({"build", files.scene.string(), "-o", files.pack.string(), "--samples",
                                      (files.inp / "below").string()});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.error.find("--samples"), std::string::npos) << run.error;
}

// Solves of another scene are not reused. Another target, precision or number of tools is the same scene.
TEST(Build, SamplesOfAnotherSceneAreNotTaken) {
  const SceneFiles files;
  const std::string scene = file_text(files.scene);
  const auto reused = [&](const std::string& changed) {
    files.dir.write("block.toml", changed);
    const ProgramRun run = run_program({"build", files.scene.string(), "-o", files.pack.string(), "--json"});
    EXPECT_EQ(run.exit_code, 0) << run.error;
    return run.exit_code == 0 && run.json()["reused"].get<int>() > 0;
  };
  const auto with = [&](const std::string& was, const std::string& now) {
    const size_t at = scene.find(was);
    EXPECT_NE(at, std::string::npos) << was;
    return std::string(scene).replace(at, was.size(), now);
  };
  EXPECT_FALSE(reused(scene));
  EXPECT_TRUE(reused(scene));
  EXPECT_TRUE(reused(scene + "[accuracy]\ntarget = 0.02\n"));
  EXPECT_FALSE(reused(with("tip_radius = 0.13", "tip_radius = 0.14")));
  EXPECT_FALSE(reused(with("[contact]\n", "[contact]\ndirections = \"inward\"\n")));
  EXPECT_FALSE(reused(with("max_displacement = 0.03", "max_displacement = 0.031")));
  EXPECT_FALSE(reused(scene + "[output]\nnodes = \"all\"\n"));
  EXPECT_FALSE(reused(scene + "[models]\npolynomial_method = \"paper_ray\"\n"));
  const std::string mesh = file_text(files.inp);
  files.dir.write("block.inp", "** a comment\n" + mesh);
  EXPECT_FALSE(reused(scene));
}

// Kills a build of many sites after it has printed its plan and begun to solve.
void kill_build_half_way(const SceneFiles& files) {
  ProgramProcess process({"build", files.scene.string(), "-o", files.pack.string(), "--jobs", "1"});
  while (process.printed_so_far().find("estimate") == std::string::npos && process.is_running())
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  process.kill_now();
  EXPECT_EQ(process.finish().exit_code, -1) << "it was through before it was killed: make the scene larger";
}

const std::string kSlow =
    "[contact]\nsites = \"surface\"\nmax_displacement = 0.05\ntip_radius = 0.13\n[accuracy]\ntarget = 1.0\n";

TEST(Build, KilledLeavesNothingUnderItsName) {
  const SceneFiles files(kSlow, block_inp(5));
  kill_build_half_way(files);
  EXPECT_FALSE(std::filesystem::exists(files.pack));
}

// It begins as packs do, for a build replaces no other file.
const std::string kYesterday = std::string("PALPATE\0", 8) + "the pack of yesterday";

TEST(Build, KilledLeavesThePackThatWasThere) {
  const SceneFiles files(kSlow, block_inp(5));
  files.dir.write("block.pack", kYesterday);
  kill_build_half_way(files);
  EXPECT_EQ(file_text(files.pack), kYesterday);
}

// The kernel kills a process that exceeds its file size limit, here in the middle of the pack.
TEST(Build, KilledWhileItWritesLeavesThePackThatWasThere) {
  const SceneFiles files;
  ASSERT_EQ(files.build().exit_code, 0) << "so that nothing but the pack is left to be written";
  files.dir.write("block.pack", kYesterday);
  const std::string command = "ulimit -c 0; ulimit -f 8; exec " PALPATE_PROGRAM " build " +
                              files.scene.string() + " -o " + files.pack.string() +
                              " --json > /dev/null 2>&1";
  const int status = std::system(("sh -c '" + command + "'").c_str());
  ASSERT_EQ(WEXITSTATUS(status), 128 + SIGXFSZ) << "it was not killed in a write: make the pack larger";
  EXPECT_EQ(file_text(files.pack), kYesterday);
  // The next build removes the partial file.
  EXPECT_EQ(names_in(files.dir.path()).size(), 5u);
  ASSERT_EQ(files.build().exit_code, 0);
  EXPECT_EQ(names_in(files.dir.path()),
            (std::vector<std::string>{"block.inp", "block.pack", "block.pack.samples", "block.toml"}));
}

TEST(Build, PlaceThatCannotBeWrittenIsSaidBeforeTheWork) {
  const SceneFiles files;
  const std::string nowhere = (files.dir.path() / "nowhere" / "x.pack").string();
  const auto refusal = [&](const std::string& pack) {
    return refusal_of({"build", files.scene.string(), "-o", pack});
  };
  EXPECT_EQ(refusal(nowhere), nowhere + ": its folder does not exist; make it first");
  EXPECT_EQ(refusal(files.dir.path().string()),
            files.dir.path().string() + ": is a folder; name a file in it");
  EXPECT_EQ(refusal(files.scene.string()),
            files.scene.string() + ": is an input of this command; name another place with -o");
  const std::string model = (files.dir.path() / "block.inp").string();
  EXPECT_EQ(refusal(model), model + ": is an input of this command; name another place with -o");
  const std::string pipe = (files.dir.path() / "pipe").string();
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(refusal(pipe), pipe + ": is a named pipe; name a file");
  std::filesystem::remove(pipe);
  EXPECT_EQ(refusal("/proc/x.pack").substr(0, 14), "/proc/x.pack: ");
  EXPECT_EQ(names_in(files.dir.path()), (std::vector<std::string>{"block.inp", "block.toml"}));
}

}  // namespace cli_interrupted_build_test
}  // namespace palpate::test
