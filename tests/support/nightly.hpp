// Longer runs on request: `./dev test --all` sets PALPATE_NIGHTLY.
#pragma once

#include <cstdlib>

namespace palpate::test {

inline bool is_nightly() {
  return std::getenv("PALPATE_NIGHTLY") != nullptr;
}

// Number of rounds: the environment `variable` if set, else `nightly` in a nightly run, else `usual`.
inline long rounds_by(const char* variable, long usual, long nightly) {
  const char* asked = std::getenv(variable);
  return asked != nullptr ? std::atol(asked) : is_nightly() ? nightly : usual;
}

}  // namespace palpate::test
