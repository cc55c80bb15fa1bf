// The exception for input that the user must correct.
#pragma once

#include <stdexcept>
#include <string>

#include "offline/mesh/model.hpp"

namespace palpate {

// what() is one line: "liver.inp:214: element 1873 is inverted (volume -3.1e-09); reorder its nodes". Line 0
// means the whole file and prints as "liver.inp: ...".
class InputError : public std::runtime_error {
 public:
  InputError(const SourceLine& where, const std::string& message)
      : std::runtime_error(where.line > 0 ? where.file + ":" + std::to_string(where.line) + ": " + message
                                          : where.file + ": " + message) {}
};

}  // namespace palpate
