// The runtime archive: an allow-list of undefined symbols, exported symbols, and the size.
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/public_headers.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/shell_command.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {
namespace symbols_test {

// libc without heap, stdio, signals, threads and exit; libm; symbols of the compiler and linker.
const std::set<std::string> kAllowed = {
    "memcmp",
    "memcpy",
    "memmove",
    "memset",
    "strlen",
    "strncmp",  // bytes
    "open",
    "open64",
    "close",
    "fstat",
    "fstat64",
    "mmap",
    "mmap64",
    "munmap",            // mapping a pack
    "__errno_location",  // reason of a failed open
    "sqrt",
    "sqrtf",
    "fabs",
    "exp",
    "log",
    "cbrt",  // libm
    "__cpu_features2",
    "__cpu_model",
    "__cpu_indicator_init",
    "_GLOBAL_OFFSET_TABLE_",
    "__stack_chk_fail",  // compiler
};

struct SymbolNames {
  std::set<std::string> defined;
  std::set<std::string> undefined;
};

// Global symbols that an archive or object defines.
SymbolNames global_symbols(const std::filesystem::path& archive) {
  const CommandResult nm = run_command(shell_word(PALPATE_NM) + " -gP " + shell_word(archive.string()));
  if (nm.exit_code != 0) throw std::runtime_error(nm.output);
  SymbolNames names;
  std::istringstream lines(nm.output);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line);
    std::string name;
    std::string type;
    if (!(fields >> name >> type) || type.size() != 1) continue;  // "archive[member]:"
    (type == "U" || type == "w" || type == "v" ? names.undefined : names.defined).insert(name);
  }
  return names;
}

// Symbols that an archive or object needs from elsewhere.
std::set<std::string> undefined_symbols(const std::filesystem::path& archive) {
  SymbolNames names = global_symbols(archive);
  for (const std::string& name : names.defined) names.undefined.erase(name);
  return names.undefined;
}

std::string forbidden_symbols(const std::filesystem::path& archive) {
  std::string forbidden;
  for (const std::string& name : undefined_symbols(archive)) {
    if (!kAllowed.contains(name)) forbidden += name + " ";
  }
  return forbidden;
}

class Symbols : public ::testing::Test {
 protected:
  void SetUp() override {
    if (kSanitized)
      GTEST_SKIP() << "an instrumented archive calls its sanitizers; the release build is checked";
  }

  // Forbidden symbols that the check finds in a translation unit with this text.
  std::string forbidden_in(const std::string& text) const {
    const std::filesystem::path source = dir_.write("unit.cpp", text);
    const std::filesystem::path object = dir_.path() / "unit.o";
    const CommandResult compiled =
        run_command(shell_word(PALPATE_CXX) + " -std=c++20 -O2 -c " + shell_word(source.string()) + " -o " +
                    shell_word(object.string()));
    if (compiled.exit_code != 0) throw std::runtime_error(compiled.output);
    return forbidden_symbols(object);
  }

  TempDir dir_;
};

TEST_F(Symbols, ArchiveNeedsOnlyAllowedSymbols) {
  EXPECT_EQ(forbidden_symbols(PALPATE_RUNTIME_ARCHIVE), "");
  // Opening a file needs these symbols, so the list was read.
  const std::set<std::string> undefined = undefined_symbols(PALPATE_RUNTIME_ARCHIVE);
  EXPECT_TRUE(undefined.contains("munmap"));
  EXPECT_TRUE(undefined.contains("close"));
}

// The headers declare every C function of the archive, and the archive defines every function of the headers. C++ names
// of the rooms stand in namespace palpate.
TEST_F(Symbols, ArchiveDefinesTheDeclaredCApi) {
  std::set<std::string> declared = declared_functions();
#if defined(PALPATE_FLOAT64) && PALPATE_FLOAT64
  for (const char* name : {"pal_visual_frame", "pal_pack_compute_normals"}) {
    declared.erase(name);
    declared.insert(std::string(name) + "_float64");
  }
#endif
  std::set<std::string> defined = global_symbols(PALPATE_RUNTIME_ARCHIVE).defined;
  std::erase_if(defined, [](const std::string& name) { return name.starts_with("_Z"); });
  EXPECT_EQ(defined, declared);
}

TEST_F(Symbols, AllowsCodeThatKeepsTheRules) {
  EXPECT_EQ(forbidden_in("#include <math.h>\nextern \"C\" double f(double x) { return sqrt(x); }"), "");
}

TEST_F(Symbols, RefusesCodeThatAllocatesThrowsPrintsLocksOrAborts) {
  const auto says = [&](const char* symbol, const std::string& text) {
    EXPECT_NE(forbidden_in(text).find(symbol), std::string::npos) << text << ": " << forbidden_in(text);
  };
  says("malloc", "#include <stdlib.h>\nvoid* f() { return malloc(8); }");
  says("_Znwm", "int* f() { return new int(1); }");
  says("__cxa_throw", "void f() { throw 1; }");
  says("printf", "#include <stdio.h>\nvoid f(int i) { printf(\"%d\", i); }");
  says("puts", "#include <stdio.h>\nvoid f() { puts(\"x\"); }");
  says("pthread_mutex_lock", "#include <mutex>\nvoid f(std::mutex& m) { m.lock(); }");
  says("abort", "#include <stdlib.h>\nvoid f() { abort(); }");
  says("__assert_fail", "#undef NDEBUG\n#include <assert.h>\nvoid f(int i) { assert(i); }");
  says("clock_gettime",
       "#include <time.h>\nint f(timespec* t) { return clock_gettime(CLOCK_MONOTONIC, t); }");
  says("__cxa_guard_acquire", "int g();\nint f() { static int i = g(); return i; }");
  says("__si_class_type_info", "struct A { virtual ~A(); };\nstruct B : A { B(); };\nB::B() {}");  // RTTI
}

TEST_F(Symbols, ArchiveIsSmall) {
  constexpr std::uintmax_t kMostBytes = 1'000'000;  // without debug information
  const std::filesystem::path copy = dir_.path() / "stripped.a";
  std::filesystem::copy_file(PALPATE_RUNTIME_ARCHIVE, copy);
  const CommandResult stripped =
      run_command(shell_word(PALPATE_STRIP) + " --strip-debug " + shell_word(copy.string()));
  ASSERT_EQ(stripped.exit_code, 0) << stripped.output;
  EXPECT_LE(std::filesystem::file_size(copy), kMostBytes);
  EXPECT_GT(std::filesystem::file_size(copy), 1024U);
}

}  // namespace symbols_test
}  // namespace palpate::test
