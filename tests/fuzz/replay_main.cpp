// replay FOLDER...: gives each file of the folders to the fuzz target, without libFuzzer.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "tests/fuzz/fuzz_target.hpp"

int main(int argc, char** argv) {
  std::size_t num_files = 0;
  for (int i = 1; i < argc; ++i) {
    for (const auto& entry : std::filesystem::directory_iterator(argv[i])) {
      std::ifstream stream(entry.path(), std::ios::binary);
      const std::vector<char> bytes(std::istreambuf_iterator<char>(stream), {});
      if (!stream) return std::fprintf(stderr, "%s: cannot be read\n", entry.path().c_str()), 1;
      std::printf("%s\n", entry.path().c_str());
      std::fflush(stdout);  // the last line names the file that ends the process
      LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
      ++num_files;
    }
  }
  std::printf("%zu files replayed, %zu accepted\n", num_files, palpate::fuzz::num_accepted);
  if (palpate::fuzz::num_accepted > 0) return 0;
  std::fputs("no file was accepted; name a folder of seeds, or renew the seeds (tests/fuzz/README.md)\n",
             stderr);
  return 1;
}
