// Work for a night: `./dev test --all` sets PALPATE_NIGHTLY.
#pragma once

#include <cstdlib>

namespace palpate::test {

inline bool is_nightly() {
  return std::getenv("PALPATE_NIGHTLY") != nullptr;
}

}  // namespace palpate::test
