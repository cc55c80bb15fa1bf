// The public headers compile alone, pedantic and without warnings: C headers as C11 and C++20, palpate.hpp as
// C++20.
#include <gtest/gtest.h>
#include <palpate/palpate.hpp>

#include <filesystem>
#include <string>

#include "tests/support/public_headers.hpp"
#include "tests/support/shell_command.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {
namespace headers_test {

const std::string kInclude = kPublicHeaders.parent_path().string();

class Headers : public ::testing::Test {
 protected:
  // Compiles a file that includes `header` twice and nothing else, with `include` as the only folder.
  CommandResult compile(const std::string& header, bool as_c, const std::string& include = kInclude,
                        const std::string& before = "") const {
    const std::string text = before + "#include <palpate/" + header + ">\n";
    const std::filesystem::path file =
        dir_.write(as_c ? "unit.c" : "unit.cpp", text + text + "int one_declaration;\n");
    return run_command(shell_word(as_c ? PALPATE_C : PALPATE_CXX) + (as_c ? " -std=c11" : " -std=c++20") +
                       " -pedantic -Wall -Wextra -Wconversion -Wshadow -Werror -fsyntax-only -I " +
                       shell_word(include) + " " + shell_word(file.string()));
  }

  // A folder with all headers, where `header` has `to` in place of `from`.
  std::string spoilt(const std::string& header, const std::string& from, const std::string& to) const {
    std::string text = header_text(header);
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw std::runtime_error(header + " has no " + from);
    text.replace(at, from.size(), to);
    std::filesystem::create_directories(dir_.path() / "include");
    std::filesystem::copy(
        kPublicHeaders, dir_.path() / "include/palpate",
        std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
    dir_.write("include/palpate/" + header, text);
    return (dir_.path() / "include").string();
  }

  TempDir dir_;
};

TEST_F(Headers, CompileAlone) {
  int num_headers = 0;
  for (const auto& file : std::filesystem::directory_iterator(kPublicHeaders)) {
    const std::string name = file.path().filename().string();
    const bool is_c = file.path().extension() == ".h";
    ++num_headers;
    for (const char* before : {"", "#define PALPATE_FLOAT64 1\n", "#define PALPATE_FLOAT64 0\n"}) {
      if (is_c) {
        const CommandResult as_c = compile(name, true, kInclude, before);
        EXPECT_EQ(as_c.exit_code, 0) << as_c.output;
      }
      const CommandResult as_cpp = compile(name, false, kInclude, before);
      EXPECT_EQ(as_cpp.exit_code, 0) << as_cpp.output;
    }
  }
  EXPECT_EQ(num_headers, 11);
}

TEST_F(Headers, CheckRefusesSpoiltHeaders) {
  EXPECT_NE(compile("palpate.hpp", true).exit_code, 0);  // palpate.hpp is not C
  const std::string without_integers = spoilt("version.h", "#include <stdint.h>", "");
  EXPECT_NE(compile("status.h", true, without_integers).exit_code, 0);
  EXPECT_NE(compile("status.h", false, without_integers).exit_code, 0);
  EXPECT_NE(compile("palpate.h", true, spoilt("session.h", "typedef struct pal_session pal_session;", ""))
                .exit_code,
            0);
  EXPECT_NE(compile("tool.h", true, spoilt("tool.h", "#include <palpate/session.h>", "")).exit_code, 0);
  const std::string with_a_reference = spoilt("session.h", "uint32_t count)", "uint32_t& count)");
  EXPECT_NE(compile("session.h", true, with_a_reference).exit_code, 0);
  EXPECT_EQ(compile("session.h", false, with_a_reference).exit_code, 0);  // a reference is valid C++
  EXPECT_NE(compile("palpate.h", true,
                    spoilt("status.h", "PAL_STATUS_BAD_CHECKSUM = 45", "PAL_STATUS_BAD_CHECKSUM = 45,,"))
                .exit_code,
            0);
  EXPECT_NE(compile("palpate.h", true, spoilt("palpate.h", "#endif /* PALPATE_PALPATE_H */", "")).exit_code,
            0);
}

TEST_F(Headers, CppFaceHasTheWholeApi) {
  const std::string face = header_text("palpate.hpp");
  const std::set<std::string> free = {"pal_version", "pal_status_text", "pal_flag_text",
                                      "pal_session_fill_config"};  // pal_default_session_config calls it
  for (const std::string& name : declared_functions()) {
    if (free.contains(name)) continue;
    EXPECT_NE(face.find(name + "("), std::string::npos) << name;
  }
}

TEST_F(Headers, LinkedVersionIsTheirs) {
  EXPECT_EQ(pal_version(), uint32_t{PAL_VERSION});
  EXPECT_EQ(std::to_string(PAL_VERSION_MAJOR) + "." + std::to_string(PAL_VERSION_MINOR) + "." +
                std::to_string(PAL_VERSION_PATCH),
            PALPATE_PROJECT_VERSION);
}

// Every flag has a text of its own. Other bits and combinations of flags have none.
TEST_F(Headers, EveryFlagHasAText) {
  const std::string none = pal_flag_text(0);
  std::set<std::string> texts = {none};
  const std::string status = header_text("status.h");
  int num_flags = 0;
  for (std::size_t at = 0; (at = status.find(" = 1 << ", at)) != std::string::npos; ++at) ++num_flags;
  for (int bit = 0; bit < num_flags; ++bit)
    EXPECT_TRUE(texts.insert(pal_flag_text(uint32_t{1} << bit)).second) << bit;
  EXPECT_EQ(pal_flag_text(uint32_t{1} << num_flags), none);
  EXPECT_EQ(pal_flag_text(3), none);
}

// C++ warns of a discarded status.
TEST_F(Headers, StatusMustBeLookedAt) {
  const std::filesystem::path file = dir_.write(
      "unit.cpp", "#include <palpate/palpate.h>\nvoid f() { pal_pack_open(0, PAL_VERIFY_ONCE, 0, 0, 0); }\n");
  const CommandResult compiled =
      run_command(shell_word(PALPATE_CXX) + " -std=c++20 -Werror -fsyntax-only -I " + shell_word(kInclude) +
                  " " + shell_word(file.string()));
  EXPECT_NE(compiled.exit_code, 0);
  EXPECT_NE(compiled.output.find("nodiscard"), std::string::npos) << compiled.output;
}

}  // namespace headers_test
}  // namespace palpate::test
