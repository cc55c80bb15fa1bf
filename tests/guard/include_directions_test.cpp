// Rooms stand on floors, and a file includes its own room and rooms below it. The tables list the floors from the
// ground up: offline and runtime meet in schemas, the public headers and runtime/kernels.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/support/temp_dir.hpp"

namespace palpate::test {
namespace include_directions_test {

// A room and the rooms that it may include, as prefixes of include paths. An include of another path of this project is
// a violation. Includes of the system and of libraries are not looked at.
using Rules = std::map<std::string, std::vector<std::string>>;

// Adds a room for each floor, which may include its own floor, the floors below it and `others`.
void add_floors(const std::string& top, const std::vector<std::string>& floors,
                const std::vector<std::string>& others, Rules& rules) {
  std::vector<std::string> allowed = others;
  for (const std::string& floor : floors) {
    allowed.push_back(top + floor + "/");
    rules[top + floor] = allowed;
  }
}

Rules rules_of_this_project() {
  Rules rules = {
      {"schemas", {"schemas/"}},
      {"runtime/include", {"palpate/"}},
      {"runtime/kernels", {"runtime/kernels/"}},
      {"offline/output", {"offline/io/", "offline/output/"}},
      {"offline/mesher", {"offline/mesh/", "offline/io/", "offline/mesher/"}},
      {"examples", {"palpate/"}},
  };
  add_floors("runtime/src/",
             {"base", "numerics", "pack", "linear", "polynomial", "elements", "exterior", "zone", "refining",
              "response", "tools", "session"},
             {"palpate/", "runtime/kernels/", "schemas/"}, rules);
  add_floors("offline/", {"numerics", "material", "mesh", "io", "fem"}, {"runtime/kernels/"}, rules);
  add_floors("offline/", {"precompute", "pack"},
             {"offline/numerics/", "offline/material/", "offline/mesh/", "offline/fem/", "schemas/"}, rules);
  add_floors("offline/", {"pipeline", "study", "report", "cli"},
             {"offline/numerics/", "offline/material/", "offline/mesh/", "offline/io/", "offline/fem/",
              "offline/precompute/", "offline/pack/", "offline/output/", "schemas/", "palpate/"},
             rules);
  return rules;
}

bool starts_with_any(const std::string& text, const std::vector<std::string>& prefixes) {
  return std::any_of(prefixes.begin(), prefixes.end(),
                     [&](const std::string& prefix) { return text.starts_with(prefix); });
}

// The path in quotes or angles of an #include line; "" for any other line.
std::string included_path(const std::string& line) {
  const auto skip_blanks = [&](std::size_t at) {
    return std::min(line.find_first_not_of(" \t", at), line.size());
  };
  std::size_t at = skip_blanks(0);
  if (line.compare(at, 1, "#") != 0) return "";
  at = skip_blanks(at + 1);
  if (line.compare(at, 7, "include") != 0) return "";
  at = skip_blanks(at + 7);
  if (at == line.size() || (line[at] != '"' && line[at] != '<')) return "";
  const std::size_t end = line.find_first_of("\">", at + 1);
  return end == std::string::npos ? "" : line.substr(at + 1, end - at - 1);
}

// Adds "offline/fem/a.cpp includes runtime/src/b.hpp" for each violation. `file` is the path from the top.
void find_violations(const std::filesystem::path& path, const std::string& file,
                     std::vector<std::string>& found) {
  const std::vector<std::string> ours = {"offline/", "runtime/", "schemas/", "palpate/",
                                         "tests/",   "bench/",   "examples/"};
  static const Rules rules = rules_of_this_project();
  const auto rule = std::find_if(rules.begin(), rules.end(),
                                 [&](const auto& folder) { return file.starts_with(folder.first + "/"); });
  if (rule == rules.end()) {
    found.push_back(file + " is in a folder without a rule");
    return;
  }
  std::ifstream stream(path);
  for (std::string line; std::getline(stream, line);) {
    const std::string target = included_path(line);
    const bool relative = target.find("..") != std::string::npos;
    if (relative || (starts_with_any(target, ours) && !starts_with_any(target, rule->second)))
      found.push_back(std::string(file).append(" includes ").append(target));
  }
}

// All violations in a source tree, sorted. `files` counts the files read.
std::vector<std::string> violations(const std::filesystem::path& root, int& files) {
  const std::set<std::string> sources = {".h", ".hpp", ".c", ".cpp", ".inl"};
  std::vector<std::string> found;
  files = 0;
  for (const char* top : {"examples", "offline", "runtime", "schemas"}) {
    if (!std::filesystem::exists(root / top)) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / top)) {
      const std::string file = std::filesystem::relative(entry.path(), root).generic_string();
      if (!entry.is_regular_file() || !sources.contains(entry.path().extension().string())) continue;
      ++files;
      find_violations(entry.path(), file, found);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<std::string> violations(const std::filesystem::path& root) {
  int files = 0;
  return violations(root, files);
}

TEST(IncludeDirections, HoldInThisTree) {
  int files = 0;
  EXPECT_EQ(violations(PALPATE_SOURCE_DIR, files), std::vector<std::string>{});
  EXPECT_GT(files, 80);  // the tree was found
}

TEST(IncludeDirections, EveryWrongDirectionIsSeen) {
  const auto seen = [](const std::string& file, const std::string& include) {
    const TempDir dir;
    dir.write(file, "// A file.\n#include <vector>\n  # include " + include + "  // why\nint x;\n");
    return violations(dir.path()).size() == 1;
  };
  EXPECT_TRUE(seen("runtime/src/session/frame.cpp", "\"offline/fem/assembly.hpp\""));
  EXPECT_TRUE(seen("runtime/include/palpate/palpate.hpp", "\"runtime/src/base/arena.hpp\""));
  EXPECT_TRUE(seen("runtime/include/palpate/palpate.h", "\"schemas/pack_layout.hpp\""));
  EXPECT_TRUE(seen("schemas/pack_layout.hpp", "\"runtime/src/base/arena.hpp\""));
  EXPECT_TRUE(seen("offline/pack/pack_writer.cpp", "<palpate/palpate.h>"));
  EXPECT_TRUE(seen("offline/precompute/linear_dd.cpp", "\"palpate/palpate.hpp\""));
  EXPECT_TRUE(seen("offline/cli/eval.cpp", "\"runtime/src/pack/pack_view.hpp\""));
  EXPECT_TRUE(seen("offline/mesh/model.hpp", "\"offline/fem/assembly.hpp\""));
  EXPECT_TRUE(seen("offline/material/law.hpp", "\"offline/mesh/model.hpp\""));
  EXPECT_TRUE(seen("offline/material/law.hpp", "\"offline/fem/assembly.hpp\""));
  EXPECT_TRUE(seen("offline/fem/assembly.hpp", "\"offline/precompute/sampling.hpp\""));
  EXPECT_TRUE(seen("offline/fem/assembly.hpp", "\"schemas/pack_layout.hpp\""));
  EXPECT_TRUE(seen("offline/precompute/sampling.hpp", "\"offline/pack/pack_writer.hpp\""));
  EXPECT_TRUE(seen("offline/pack/pack_writer.hpp", "\"offline/cli/commands.hpp\""));
  EXPECT_TRUE(seen("offline/pack/pack_writer.hpp", "\"offline/output/renderer.hpp\""));
  EXPECT_TRUE(seen("offline/output/renderer.hpp", "\"offline/mesh/model.hpp\""));
  EXPECT_TRUE(seen("offline/report/html_page.cpp", "\"offline/cli/commands.hpp\""));
  EXPECT_TRUE(seen("offline/fem/assembly.hpp", "\"../mesh/model.hpp\""));
  EXPECT_TRUE(seen("runtime/src/session/frame.cpp", "\"tests/support/temp_dir.hpp\""));
  EXPECT_TRUE(seen("examples/01.cpp", "\"runtime/src/base/arena.hpp\""));
  EXPECT_TRUE(seen("offline/new_stage/a.cpp", "<vector>"));
  EXPECT_TRUE(seen("runtime/src/frame.cpp", "<vector>"));
  EXPECT_TRUE(seen("runtime/src/linear/linear_dd.cpp", "\"runtime/src/zone/zone_set.hpp\""));
  EXPECT_TRUE(seen("runtime/src/tools/tools.cpp", "\"runtime/src/session/recording.hpp\""));
  EXPECT_TRUE(seen("offline/pipeline/ranks.cpp", "\"offline/study/organ_report.hpp\""));
  EXPECT_TRUE(seen("offline/study/organ_report.cpp", "\"offline/report/html_page.hpp\""));
}

TEST(IncludeDirections, RightDirectionsPass) {
  const TempDir dir;
  dir.write("runtime/src/session/frame.cpp",
            "#include <palpate/palpate.h>\n#include \"schemas/pack_layout.hpp\"\n");
  dir.write("offline/cli/eval.cpp",
            "#include <palpate/palpate.h>\n#include \"offline/pack/pack_writer.hpp\"\n");
  dir.write("offline/fem/assembly.cpp",
            "#include \"offline/mesh/model.hpp\"\n// #include \"offline/cli/x.hpp\"\n");
  int files = 0;
  EXPECT_EQ(violations(dir.path(), files), std::vector<std::string>{});
  EXPECT_EQ(files, 3);
}

}  // namespace include_directions_test
}  // namespace palpate::test
