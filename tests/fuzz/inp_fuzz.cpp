// Reads arbitrary text as a model. Bad input may throw InputError alone.
#include <string_view>

#include "offline/mesh/inp_reader.hpp"
#include "offline/mesh/input_error.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/support/temp_dir.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const palpate::test::TempDir dir;
  try {
    palpate::read_inp(dir.write("model.inp", {reinterpret_cast<const char*>(data), size}));
    ++palpate::fuzz::num_accepted;
  } catch (const palpate::InputError&) {
  }
  return 0;
}
