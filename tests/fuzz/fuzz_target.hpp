// What a fuzz target and its main program share.
#pragma once

#include <cstddef>
#include <cstdint>

// The entry of libFuzzer. Returns 0; a defect ends the process.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace palpate::fuzz {

// Number of inputs that the reader accepted. replay_main.cpp fails where it stays 0: the seeds are then too old.
inline std::size_t num_accepted = 0;

}  // namespace palpate::fuzz
