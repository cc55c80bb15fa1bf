// The program as a user runs it, with a user's mistakes.
#include <fmt/core.h>

#include <algorithm>

#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"
#include "tests/support/block_mesh.hpp"
#include "tests/support/shell_command.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::hard {
namespace {

const char* const kContact = "sites = [54, 55]\nmax_displacement = 0.05\ntip_radius = 0.13\n";

// Writes a block and its scene with this [contact], and runs a shell line with PALPATE, SCENE, PACK and DIR
// replaced.
std::vector<Answer> run(const std::string& contact, const std::string& line) {
  constexpr int kPatience = 60;
  constexpr int kKilled = 124;  // exit code of timeout(1)
  const test::TempDir dir;
  dir.write("block.inp", test::block_inp(3));
  dir.write("block.toml", "model = \"block.inp\"\n[contact]\n" + contact);
  const test::CommandResult result = test::run_command(
      fmt::format("cd {}; export PALPATE='timeout {} {}'; {}", test::shell_word(dir.path().string()),
                  kPatience, test::shell_word(PALPATE_PROGRAM), line));
  std::string said = dir.without_folder(result.output);
  while (said.ends_with('\n')) said.pop_back();
  said = said.substr(said.rfind('\n') + 1);
  Answer answer;
  answer.by = "program";
  answer.happened = said;
  if (result.exit_code == kKilled) {
    answer.happened = "did not end";
    return {answer};
  }
  if (result.exit_code == 1 && !said.empty()) return {refused("program", said)};
  if (result.exit_code == 0) {
    answer.displacement_error = 0;
    return {answer};
  }
  answer.happened = fmt::format("exit code {}: {}", result.exit_code, said);
  return {answer};
}

// Expects this flag in the output of `eval --json`.
std::vector<Answer> flagged(const std::string& line, const std::string& flag) {
  const std::string build = "$PALPATE build block.toml -o a.pack > /dev/null && ";
  std::vector<Answer> answers = run(kContact, build + line + " --json | tr -d '\\n'");
  Answer& answer = answers.front();
  answer.displacement_error = Answer::kNotMeasured;
  if (answer.happened.find('"' + flag + '"') != std::string::npos) answer.flags = {flag};
  if (!answer.refused) answer.happened = "answered";
  return answers;
}

}  // namespace

Group program_cases() {
  Group group{"program",
              "The program",
              "What a user gets wrong, in a scene or on the command line: one line says what, or the answer "
              "is flagged.",
              {}};
  const auto add = [&](const std::string& name, const std::string& hard, Expected expected, auto run) {
    group.cases.push_back({"program", name, hard, {}, expected, "", run});
  };
  const auto scene = [&](const std::string& name, const std::string& hard, const std::string& contact) {
    add(name, hard, Expected::nothing,
        [contact] { return run(contact, "$PALPATE build block.toml -o a.pack"); });
  };
  const auto line = [&](const std::string& name, const std::string& hard, Expected expected,
                        const std::string& text) {
    add(name, hard, expected, [text] { return run(kContact, text); });
  };
  scene("no_sites", "sites = \"\"", "sites = \"\"\nmax_displacement = 0.05\n");
  scene("tip_radius", "tip_radius = 1e16", "sites = [54]\nmax_displacement = 0.05\ntip_radius = 1e16\n");
  scene("whole_surface", "a tip that covers every free surface node, pushed by an edge",
        "sites = [54]\nmax_displacement = 1.5\ntip_radius = 100\n");
  // The domain of the site is cut down, and the build warns of the reach and of the errors.
  add("far_push", "max_displacement ten times the organ", Expected::answer,
      [] { return run("sites = [54]\nmax_displacement = 4\n", "$PALPATE build block.toml -o a.pack"); });
  line("no_pack_name", "build -o \"\"", Expected::nothing, "$PALPATE build block.toml -o ''");
  line(
      "no_output_name", "eval -o \"\"", Expected::nothing,
      "$PALPATE build block.toml -o a.pack > /dev/null && $PALPATE eval a.pack --contact 54=0,0,-0.01 -o ''");
  line("no_model_name", "solve \"\"", Expected::nothing, "$PALPATE solve '' -o out");
  line("broken_samples", "a file of kept samples that is noise", Expected::answer,
       "$PALPATE build block.toml -o a.pack > /dev/null && for f in $(find a.pack.samples -type f); do head "
       "-c 5000 /dev/urandom "
       "> $f; done && mv a.pack b.pack && $PALPATE build block.toml -o a.pack > /dev/null && cmp a.pack "
       "b.pack");
  line("full_samples", "a folder of samples that cannot be written", Expected::answer,
       "ln -s /dev/full full && mkdir s && $PALPATE build block.toml -o a.pack --samples s > /dev/null && "
       "for f in $(find s -type f); do "
       "ln -sf /dev/full $f; done && $PALPATE build block.toml -o b.pack --samples s > /dev/null && cmp "
       "a.pack b.pack");
  line("little_memory", "100 MB of address space for a build", Expected::nothing,
       "(ulimit -v 100000; $PALPATE build block.toml -o a.pack)");
  line("memory_of_one_thread", "400 MB of address space and one thread of BLAS", Expected::answer,
       "(ulimit -v 400000; OPENBLAS_NUM_THREADS=1 $PALPATE build block.toml -o a.pack --jobs 1 > /dev/null)");
  add("far_place", "eval --at a place far from any site", Expected::nothing,
      [] { return flagged("$PALPATE eval a.pack --at 10,20,60=0,0,-0.03", "off_surface"); });
  add("held_and_fixed", "eval with --fix and --contact at the same node", Expected::nothing,
      [] { return flagged("$PALPATE eval a.pack --contact 54=0,0,-0.03 --fix 54", "holds_fixed_node"); });
  return group;
}

}  // namespace palpate::hard
