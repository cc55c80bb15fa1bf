// Collects the text and the binary numbers of a file that is written.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <iterator>
#include <string>
#include <utility>

namespace palpate {

class FileText {
 public:
  template <typename... Values>
  void text(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(bytes), format, std::forward<Values>(values)...);
  }

  // `is_big`: the most significant byte first.
  template <typename Number>
  void binary(Number number, bool is_big = false) {
    const char* from = reinterpret_cast<const char*>(&number);
    bytes.append(from, sizeof number);
    if (is_big == (std::endian::native == std::endian::little))
      std::reverse(bytes.end() - static_cast<std::ptrdiff_t>(sizeof number), bytes.end());
  }

  std::string bytes;
};

}  // namespace palpate
