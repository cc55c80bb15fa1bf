// The exception for input that the user must correct.
#pragma once

#include <stdexcept>
#include <string>

#include "offline/mesh/model.hpp"

namespace palpate {

// Returns "file:line"; line 0 means the whole file and gives "file".
inline std::string location(const SourceLine& where) {
  return where.line > 0 ? where.file + ":" + std::to_string(where.line) : where.file;
}

// The text is one line: "liver.inp:214: element 1873 is inverted (volume -3.1e-09); reorder its nodes". A reader
// that goes on after a refusal throws all of them together, one line each.
class InputError : public std::runtime_error {
 public:
  InputError(const SourceLine& where, const std::string& message)
      : std::runtime_error(location(where) + ": " + message) {}
  explicit InputError(const std::string& lines) : std::runtime_error(lines) {}
};

}  // namespace palpate
