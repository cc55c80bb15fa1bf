// The text of the public headers, for the tests that compare an API with documents and wrappers.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <stdexcept>
#include <string>

namespace palpate::test {

inline const std::filesystem::path kPublicHeaders =
    std::filesystem::path(PALPATE_SOURCE_DIR) / "runtime/include/palpate";

inline std::string header_text(const std::string& name) {
  std::ifstream stream(kPublicHeaders / name);
  if (!stream) throw std::runtime_error("no header " + name);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

// Names of all functions that the C headers declare with PAL_API.
inline std::set<std::string> declared_functions() {
  std::set<std::string> names;
  const std::regex declaration(R"(PAL_API\s[^;(]*\b(pal_\w+)\()");
  for (const auto& file : std::filesystem::directory_iterator(kPublicHeaders)) {
    if (file.path().extension() != ".h") continue;
    const std::string text = header_text(file.path().filename().string());
    for (std::sregex_iterator at(text.begin(), text.end(), declaration), end; at != end; ++at)
      names.insert((*at)[1]);
  }
  return names;
}

}  // namespace palpate::test
