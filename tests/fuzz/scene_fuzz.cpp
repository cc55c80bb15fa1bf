// Reads arbitrary text as a scene of the block in the corpus. Bad input may throw InputError alone.
#include <cstdlib>
#include <string>

#include "offline/mesh/input_error.hpp"
#include "offline/mesh/text_file.hpp"
#include "offline/precompute/scene.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/support/temp_dir.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const palpate::test::TempDir dir;
  static const bool has_model = [] {
    std::string text;
    const bool read = palpate::read_text_file(PALPATE_FUZZ_MODEL, text).empty();
    dir.write("inp/block.inp", text);  // where the scenes of the corpus name it
    return read;
  }();
  if (!has_model) std::abort();
  try {
    palpate::read_scene(dir.write("scene/scene.toml", {reinterpret_cast<const char*>(data), size}));
    ++palpate::fuzz::num_accepted;
  } catch (const palpate::InputError&) {
  }
  return 0;
}
