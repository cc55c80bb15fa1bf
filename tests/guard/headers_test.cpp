// The public headers, each alone: palpate.h as C11 and C++20, palpate.hpp as C++20, pedantic, no warning.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/support/shell_command.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {
namespace {

const std::string kInclude = std::string(PALPATE_SOURCE_DIR) + "/runtime/include";

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

  // A folder with palpate.h in which `from` stands as `to`.
  std::string spoilt(const std::string& from, const std::string& to) const {
    std::ifstream stream(kInclude + "/palpate/palpate.h");
    std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw std::runtime_error("palpate.h has no " + from);
    text.replace(at, from.size(), to);
    dir_.write("include/palpate/palpate.h", text);
    return (dir_.path() / "include").string();
  }

  TempDir dir_;
};

TEST_F(Headers, CompileAlone) {
  const CommandResult as_c = compile("palpate.h", true);
  EXPECT_EQ(as_c.exit_code, 0) << as_c.output;
  const CommandResult as_cpp = compile("palpate.h", false);
  EXPECT_EQ(as_cpp.exit_code, 0) << as_cpp.output;
  const CommandResult face = compile("palpate.hpp", false);
  EXPECT_EQ(face.exit_code, 0) << face.output;
  for (const char* before : {"#define PALPATE_FLOAT64 1\n", "#define PALPATE_FLOAT64 0\n"}) {
    EXPECT_EQ(compile("palpate.h", true, kInclude, before).exit_code, 0);
    EXPECT_EQ(compile("palpate.hpp", false, kInclude, before).exit_code, 0);
  }
}

TEST_F(Headers, CheckRefusesSpoiltHeaders) {
  EXPECT_NE(compile("palpate.hpp", true).exit_code, 0);  // C++ is no C
  const std::string without_integers = spoilt("#include <stdint.h>", "");
  EXPECT_NE(compile("palpate.h", true, without_integers).exit_code, 0);
  EXPECT_NE(compile("palpate.h", false, without_integers).exit_code, 0);
  EXPECT_NE(compile("palpate.h", true, spoilt("typedef struct pal_session pal_session;", "")).exit_code, 0);
  const std::string with_a_reference = spoilt("uint32_t count,", "uint32_t& count,");
  EXPECT_NE(compile("palpate.h", true, with_a_reference).exit_code, 0);
  EXPECT_EQ(compile("palpate.h", false, with_a_reference).exit_code, 0);  // C++ would not have noticed
  EXPECT_NE(
      compile("palpate.h", true, spoilt("PAL_STATUS_BAD_CHECKSUM = 45", "PAL_STATUS_BAD_CHECKSUM = 45,,"))
          .exit_code,
      0);
  EXPECT_NE(compile("palpate.h", true, spoilt("#endif /* PALPATE_PALPATE_H */", "")).exit_code, 0);
}

// What is returned must be looked at, in C++.
TEST_F(Headers, StatusMustBeLookedAt) {
  const std::filesystem::path file = dir_.write(
      "unit.cpp", "#include <palpate/palpate.h>\nvoid f() { pal_pack_open(0, PAL_VERIFY_ONCE, 0, 0, 0); }\n");
  const CommandResult compiled =
      run_command(shell_word(PALPATE_CXX) + " -std=c++20 -Werror -fsyntax-only -I " + shell_word(kInclude) +
                  " " + shell_word(file.string()));
  EXPECT_NE(compiled.exit_code, 0);
  EXPECT_NE(compiled.output.find("nodiscard"), std::string::npos) << compiled.output;
}

}  // namespace
}  // namespace palpate::test
