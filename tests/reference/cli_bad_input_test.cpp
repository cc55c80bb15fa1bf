// Unusable input: a line with file, line number and remedy, exit code 1, no pack.
#include <gtest/gtest.h>

#include "tests/support/inp_fixture.hpp"
#include "tests/support/scene_files.hpp"

namespace palpate::test {
namespace cli_bad_input_test {

class BadScene : public ::testing::Test {
 protected:
  // The message of `build`, without the folder of the test.
  std::string refusal(const std::string& scene, const std::string& model = kBody) const {
    dir_.write("organ.inp", model);
    const std::string file = dir_.write("organ.toml", scene).string();
    const std::filesystem::path pack = dir_.path() / "organ.pack";
    std::string message = refusal_of({"build", file, "-o", pack.string()});
    EXPECT_FALSE(std::filesystem::exists(pack));
    const std::string folder = dir_.path().string() + "/";
    for (size_t at = 0; (at = message.find(folder)) != std::string::npos;) message.erase(at, folder.size());
    return message;
  }

  TempDir dir_;
};

const std::string kGoodScene = "model = \"organ.inp\"\n[contact]\nsites = [4]\nmax_displacement = 0.01\n";

struct Case {
  const char* name;
  std::string scene;
  std::string model;
  std::vector<std::string> words;  // words in the message; the message starts with the first
};

TEST(BadInput, NameWithControlCharactersLeavesTheTerminalAsItIs) {
  EXPECT_EQ(refusal_of({"info", "red\x1b[31m.pack"}), "red?[31m.pack: the file does not exist");
  EXPECT_EQ(refusal_of({"info", "a.pack", "--\x1b[31m"}).find('\x1b'), std::string::npos);
}

TEST_F(BadScene, EachIsNamedByFileAndLine) {
  const std::vector<Case> cases = {
      {"missing model",
       "model = \"none.inp\"\n[contact]\nsites = [4]\nmax_displacement = 1\n",
       kBody,
       {"organ.toml:1: ", "none.inp", "correct"}},
      {"unsupported keyword",
       kGoodScene,
       kBody + "*SHELL SECTION, ELSET=BODY\n1\n",
       {"organ.inp:18: ", "*SHELL SECTION"}},
      {"undefined node", kGoodScene, with_line(9, "2, 2, 77, 3, 4"), {"organ.inp:9: ", "77"}},
      {"inverted element",
       kGoodScene,
       with_line(8, "1, 2, 1, 3, 4"),
       {"organ.inp:8: ", "element 1", "inverted", "reorder"}},
      {"set of the model", kGoodScene, with_line(17, "BAES, 1, 3"), {"organ.inp:17: ", "BAES", "BASE"}},
      {"set of the scene",
       "model = \"organ.inp\"\n[contact]\nsites = \"PROBE\"\nmax_displacement = 1\n",
       kBody,
       {"organ.toml:3: ", "PROBE"}},
      {"nothing fixed", kGoodScene, with_line(16, "", with_line(17, "")), {"organ.inp", "*BOUNDARY"}},
      {"unknown key", kGoodScene + "tip_radus = 1\n", kBody, {"organ.toml:5: ", "tip_radus", "tip_radius"}},
      {"site on a fixed node",
       "model = \"organ.inp\"\n[contact]\nsites = [4, 1]\nmax_displacement = 1\n",
       kBody,
       {"organ.toml:3: ", "node 1", "fixed", "take it out"}},
      {"empty name of a set",
       "model = \"organ.inp\"\n[contact]\nsites = \"\"\nmax_displacement = 1\n",
       kBody,
       {"organ.toml:3: ", "contact.sites is empty", "name"}},
      {"absurd tip", kGoodScene + "tip_radius = 1e16\n", kBody, {"organ.toml:5: ", "tip_radius", "1e15"}},
      {"TOML", "model = \"organ.inp\"\n[contact\nsites = [4]\n", kBody, {"organ.toml:2: ", "TOML"}},
      {"empty scene", "", kBody, {"organ.toml", "missing"}},
      {"empty model", kGoodScene, "", {"organ.inp"}},
  };
  for (const Case& one : cases) {
    const std::string message = refusal(one.scene, one.model);
    EXPECT_TRUE(message.starts_with(one.words.front())) << one.name << ": " << message;
    for (const std::string& word : one.words)
      EXPECT_NE(message.find(word), std::string::npos) << one.name << ": " << message;
  }
}

TEST_F(BadScene, MissingSceneAndFolderForAScene) {
  EXPECT_EQ(refusal_of({"build", "nothing.toml", "-o", (dir_.path() / "x.pack").string()}).substr(0, 14),
            "nothing.toml: ");
  refusal_of({"build", dir_.path().string(), "-o", (dir_.path() / "x.pack").string()});
  EXPECT_EQ(names_in(dir_.path()).size(), 0u);
}

TEST(BadPack, EveryCommandThatReadsOneRefusesIt) {
  const TempDir dir;
  const std::string text = dir.write("notes.pack", "not a pack at all\n").string();
  const std::string none = (dir.path() / "none.pack").string();
  const std::string png = (dir.path() / "x.png").string();
  for (const std::string& file : {text, none, dir.path().string()}) {
    for (const char* command : {"info", "verify", "eval", "bench"})
      EXPECT_TRUE(refusal_of({command, file}).starts_with(file + ": ")) << command;
    EXPECT_TRUE(refusal_of({"picture", file, "-o", png}).starts_with(file + ": "));
  }
  EXPECT_FALSE(std::filesystem::exists(png));
}

TEST(CommandLine, NothingGivenPrintsTheUsage) {
  const ProgramRun run = run_program({});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_EQ(run.out, "");
  for (const char* command : {"solve", "build", "info", "verify", "eval", "picture", "bench"})
    EXPECT_NE(run.error.find(command), std::string::npos);
  EXPECT_TRUE(run.error.ends_with("palpate: name a command\n"));
}

TEST(CommandLine, MistakesAreNamedWithTheRightHelp) {
  EXPECT_EQ(refusal_of({"biuld"}),
            "palpate: there is no command biuld; did you mean build?; see 'palpate --help'");
  EXPECT_EQ(refusal_of({"xyzzy"}), "palpate: there is no command xyzzy; see 'palpate --help'");
  EXPECT_EQ(refusal_of({"--jsn"}), "palpate: there is no option --jsn; see 'palpate --help'");
  EXPECT_EQ(refusal_of({"solve", "a.inp", "--ouput", "d"}),
            "palpate solve: there is no option --ouput; did you mean --output?; see 'palpate solve --help'");
  EXPECT_EQ(refusal_of({"--json", "info", "a"}),
            "palpate info: the option --json belongs behind info; see 'palpate info --help'");
  EXPECT_EQ(refusal_of({"solve"}).substr(0, 15), "palpate solve: ");
  EXPECT_EQ(refusal_of({"solve", "a.inp"}),
            "palpate solve: --output is required; see 'palpate solve --help'");
  EXPECT_EQ(refusal_of({"info", "a", "b"}),
            "palpate info: The following argument was not expected: b; see 'palpate info --help'");
  EXPECT_EQ(refusal_of({"eval", "a.pack", "-o", ""}),
            "palpate: argument 4 is empty, behind -o; name a file or give a value");
  EXPECT_EQ(refusal_of({""}), "palpate: argument 1 is empty; name a file or give a value");
  for (const char* jobs : {"0", "-1", "many", "1e9"})
    EXPECT_NE(refusal_of({"build", "a.toml", "-o", "b", "--jobs", jobs}).find("--jobs"), std::string::npos);
}

TEST(CommandLine, HelpTeachesByExample) {
  for (const char* option : {"--help", "-h"}) {
    EXPECT_NE(run_cleanly({option}).out.find("palpate build"), std::string::npos);
    for (const std::string command : {"solve", "build", "info", "verify", "eval", "picture", "bench"}) {
      const std::string help = run_cleanly({command, option}).out;
      EXPECT_NE(help.find("Example: palpate " + command), std::string::npos) << help;
      EXPECT_NE(help.find("--json"), std::string::npos) << help;
    }
  }
}

// A full disk, for standard output and for files.
TEST(CommandLine, OutputThatDoesNotArriveIsAFailure) {
  const SceneFiles files;
  ASSERT_EQ(files.build().exit_code, 0);
  const std::string pack = files.pack.string();
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--help"},
                                                    {"info", pack},
                                                    {"info", pack, "--json"},
                                                    {"verify", pack},
                                                    {"eval", pack, "--json"}}) {
    const ProgramRun run = ProgramProcess(arguments, "/dev/full").finish();
    EXPECT_EQ(run.exit_code, 1) << arguments.front();
    EXPECT_NE(run.error.find("No space left"), std::string::npos) << run.error;
  }
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"eval", pack, "-o", "/dev/full"},
        {"build", files.scene.string(), "-o", "/dev/full", "--json"}}) {
    const ProgramRun run = run_program(arguments);
    EXPECT_EQ(run.exit_code, 1) << arguments.front();
    EXPECT_NE(run.error.find("/dev/full"), std::string::npos) << run.error;
  }
  ASSERT_TRUE(std::filesystem::is_character_file("/dev/full")) << "a result was renamed onto the device";
  EXPECT_EQ(run_cleanly({"eval", pack, "-o", "/dev/stdout"}).out.substr(0, 5), "node,");
}

}  // namespace cli_bad_input_test
}  // namespace palpate::test
