// Reads arbitrary text as a model. Bad input may throw InputError alone.
#include <string_view>

#include "offline/mesh/geometry_check.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "offline/mesh/input_error.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/support/temp_dir.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const palpate::test::TempDir dir;
  try {
    const auto file = dir.write("model.inp", {reinterpret_cast<const char*>(data), size});
    const palpate::Model model = palpate::read_inp(file);
    ++palpate::fuzz::num_accepted;
    palpate::unjoined_messages(model, palpate::find_unjoined(model));
    palpate::read_inp(file, {}, 0.3);
  } catch (const palpate::InputError&) {
  }
  return 0;
}
