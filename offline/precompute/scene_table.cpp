#include "offline/precompute/scene_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "offline/mesh/input_error.hpp"
#include "offline/mesh/nearest_name.hpp"
#include "offline/mesh/text_file.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) list += i + 1 == names.size() ? " or " : ", ";
    list += names[i];
  }
  return list;
}

// Prints a value of the file, shortened for a message.
std::string shown(const toml::node& node) {
  if (node.is_string()) return '"' + printable(node.as_string()->get()) + '"';
  if (node.is_table()) return "a table";
  if (node.is_array()) return "an array";
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return printable(text.str());
}

// Returns the node's finite number, if any.
std::optional<double> as_finite(const toml::node& node) {
  double value = std::numeric_limits<double>::infinity();
  if (const auto* integer = node.as_integer()) value = static_cast<double>(integer->get());
  if (const auto* number = node.as_floating_point()) value = number->get();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

// Returns the line where a file nests tables, arrays or dotted keys deeper than kDeepest; 0: nowhere. The
// parser is recursive: unbounded nesting would exhaust the stack.
int too_deep_line(const std::string& text) {
  constexpr int kDeepest = 16;
  int line = 1;
  int brackets = 0;
  int dots = 0;  // since the last separator: the depth of a dotted key
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '#') {
      i = std::min(text.find('\n', i), text.size()) - 1;
    } else if (c == '"' || c == '\'') {
      const bool is_long = text.compare(i, 3, std::string(3, c)) == 0;
      const std::size_t begin = i + (is_long ? 3 : 1);
      for (i = begin; i < text.size(); ++i) {
        if (c == '"' && text[i] == '\\') {
          ++i;
        } else if (is_long ? text.compare(i, 3, std::string(3, c)) == 0 : text[i] == c || text[i] == '\n') {
          break;
        }
        if (i < text.size() && text[i] == '\n') ++line;
      }
      i += is_long ? 2 : 0;
      if (!is_long && i < text.size() && text[i] == '\n') --i;
    } else if (c == '.') {
      ++dots;
    } else if (c == '\n' || c == ',' || c == '=' || c == '[' || c == ']' || c == '{' || c == '}') {
      dots = 0;
      brackets += c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
    }
    if (brackets > kDeepest || dots > kDeepest) return line;
    if (c == '\n') ++line;
  }
  return 0;
}

}  // namespace

toml::table parse_toml(const std::string& file) {
  std::string text;
  const std::string unreadable = read_text_file(file, text, kMaxSceneBytes);
  if (!unreadable.empty()) throw InputError({file, 0}, unreadable);
  if (const int line = too_deep_line(text); line > 0)
    throw InputError({file, line}, "tables, arrays or keys are nested more than 16 deep; a scene needs 3");
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    constexpr std::size_t kLongest = 300;  // bytes of the parser's message, which quotes the file
    throw InputError({file, static_cast<int>(error.source().begin.line)},
                     "not valid TOML: " + printable(error.description(), kLongest));
  }
}

void SceneTable::allow(std::initializer_list<std::string_view> known) const {
  const std::vector<std::string> names(known.begin(), known.end());
  for (const auto& [key, value] : *table_) {
    if (std::find(known.begin(), known.end(), key.str()) != known.end()) continue;
    const std::string suggestion = did_you_mean(key.str(), names);
    throw InputError({file_, static_cast<int>(key.source().begin.line)},
                     printable(path(key.str())) + " is not known" +
                         (suggestion.empty() ? "; write " + listed(names) : suggestion));
  }
}

SceneTable SceneTable::table(std::string_view key) const {
  static const toml::table empty;
  const toml::node* node = find(key);
  if (node == nullptr) return {empty, path(key), file_};
  if (!node->is_table()) fail_type(key, "a table, written [" + path(key) + "]");
  return {*node->as_table(), path(key), file_};
}

std::optional<std::string> SceneTable::string(std::string_view key) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_string()) fail_type(key, "a text in double quotes");
  return node->as_string()->get();
}

std::optional<double> SceneTable::finite_number(std::string_view key, const std::string& expected) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  const std::optional<double> value = as_finite(*node);
  if (!value) fail_type(key, expected);
  return value;
}

std::optional<double> SceneTable::number_above_zero(std::string_view key) const {
  const char* expected = "a number above 0";
  const std::optional<double> value = finite_number(key, expected);
  if (value && *value <= 0) fail_type(key, expected);
  return value;
}

std::optional<double> SceneTable::number_from_zero(std::string_view key) const {
  const char* expected = "a number, 0 or above";
  const std::optional<double> value = finite_number(key, expected);
  if (value && *value < 0) fail_type(key, expected);
  return value;
}

std::optional<int> SceneTable::integer(std::string_view key, int least, int most) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  const auto* integer = node->as_integer();
  if (integer == nullptr || integer->get() < least || integer->get() > most) {
    fail_type(key, "a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  }
  return static_cast<int>(integer->get());
}

std::optional<bool> SceneTable::boolean(std::string_view key) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_boolean()) fail_type(key, "true or false");
  return node->as_boolean()->get();
}

std::optional<bool> SceneTable::boolean_or_auto(std::string_view key) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (const auto* boolean = node->as_boolean()) return boolean->get();
  if (node->is_string() && node->as_string()->get() == "auto") return std::nullopt;
  fail_type(key, "true, false or \"auto\"");
}

std::optional<std::vector<int>> SceneTable::integers(std::string_view key, const char* expected) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  const toml::array* array = node->as_array();
  if (array == nullptr) fail_type(key, expected);
  std::vector<int> values;
  for (const toml::node& item : *array) {
    const auto* integer = item.as_integer();
    if (integer == nullptr || integer->get() < 1 || integer->get() > std::numeric_limits<int>::max()) {
      throw InputError({file_, static_cast<int>(item.source().begin.line)},
                       path(key) + " must be " + expected + ", and " + shown(item) + " is none; correct it");
    }
    values.push_back(static_cast<int>(integer->get()));
  }
  return values;
}

std::optional<std::array<double, 3>> SceneTable::vector(std::string_view key) const {
  const std::string expected = "an array of three finite numbers";
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  const toml::array* array = node->as_array();
  if (array == nullptr) fail_type(key, expected);
  const auto refuse = [&](const std::string& what) {
    fail(key, path(key) + " must be " + expected + ", and " + what + "; correct it");
  };
  if (array->size() != 3) refuse("this has " + std::to_string(array->size()));
  std::array<double, 3> values = {};
  for (std::size_t i = 0; i < 3; ++i) {
    if (const std::optional<double> value = as_finite(*array->get(i))) {
      values[i] = *value;
    } else {
      refuse(shown(*array->get(i)) + " is none");
    }
  }
  return values;
}

std::optional<std::size_t> SceneTable::choice(std::string_view key,
                                              const std::vector<std::string>& choices) const {
  const std::optional<std::string> value = string(key);
  if (!value) return std::nullopt;
  const auto found = std::find(choices.begin(), choices.end(), *value);
  if (found == choices.end()) fail_type(key, listed(choices));
  return static_cast<std::size_t>(found - choices.begin());
}

bool SceneTable::is_string(std::string_view key) const {
  const toml::node* node = find(key);
  return node != nullptr && node->is_string();
}

std::string SceneTable::path(std::string_view key) const {
  return name_.empty() ? std::string(key) : name_ + "." + std::string(key);
}

void SceneTable::fail(std::string_view key, const std::string& message) const {
  const toml::node* node = find(key);
  int line = static_cast<int>(table_->source().begin.line);
  if (node != nullptr) {
    line = static_cast<int>(table_->find(key)->first.source().begin.line);
  } else if (name_.empty()) {
    line = 0;  // absent from the whole file
  }
  throw InputError({file_, line}, message);
}

void SceneTable::fail_type(std::string_view key, const std::string& expected) const {
  fail(key, path(key) + " must be " + expected + ", not " + shown(*find(key)) + "; correct it");
}

}  // namespace palpate
