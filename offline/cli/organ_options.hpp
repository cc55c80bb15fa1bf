// The options of `palpate check` and `palpate new` that say how a mesh is read and where places are.
#pragma once

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "offline/cli/organ_file.hpp"
#include "offline/cli/organ_scene.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {

inline constexpr const char* kPlacesHelp =
    "Places for --fix and --probe:\n"
    "  \"z<10%\"               the lowest tenth; also x, y, > and a length: \"x>3.5\"\n"
    "  \"box x,y,z,x,y,z\"     between two corners\n"
    "  \"nearest x,y,z,r\"     the nearest node, and all within r\n"
    "  NAME                  a node set of the mesh\n";

inline std::vector<std::string> unit_names() {
  std::vector<std::string> names;
  names.reserve(kUnits.size());
  for (const Units& units : kUnits) names.emplace_back(units.length);
  return names;
}

// CLI11's own check says the largest double, with its 309 digits.
inline CLI::Validator above_zero() {
  return {[](const std::string& text) {
            const std::optional<double> number = parse_number(text);
            return number && *number > 0 ? "" : "must be above 0, not '" + printable(text) + "'";
          },
          "POSITIVE"};
}

// Refuses an option that would change a model with its own laws and supports.
[[noreturn]] inline void refuse_deck_option(const std::string& file, const char* option) {
  throw std::runtime_error(fmt::format(
      "{}: has laws and supports of its own, which {} would change; leave {} out, or edit the file", file,
      option, option));
}

inline void add_organ_options(CLI::App& command, OrganOptions& options) {
  command.add_option("--scale", options.scale, "Multiply all positions; 1000: from metres to millimetres")
      ->check(above_zero())
      ->capture_default_str();
  command
      .add_option("--merge", options.merge_length,
                  "Join nodes that lie closer together than this, after --scale")
      ->type_name("LENGTH")
      ->check(above_zero());
  command
      .add_option_function<std::string>(
          "--keep", [&options](const std::string&) { options.keep_largest = true; },
          "largest: drop all parts of the mesh but the one with the most elements")
      ->check(CLI::IsMember({"largest"}));
}

}  // namespace palpate
