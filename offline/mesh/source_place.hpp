// Stores the place of an input item in eight bytes. A SourceLine holds a string, too large for each of
// 100,000 elements. Readers keep a Place and convert it to a SourceLine for a message.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

struct Place {
  int file = 0;  // index in SourceFiles
  int line = 0;  // from 1; 0 = the file as a whole
};

// The model file first, then each file it includes.
class SourceFiles {
 public:
  int add(std::string name) {
    names_.push_back(std::move(name));
    return static_cast<int>(names_.size()) - 1;
  }
  const std::vector<std::string>& names() const { return names_; }
  SourceLine at(Place place) const { return {names_[static_cast<std::size_t>(place.file)], place.line}; }

 private:
  std::vector<std::string> names_;
};

}  // namespace palpate
