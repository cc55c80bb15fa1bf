// Typed access to a table of a TOML file; every error message has file and line.
#pragma once

#include <toml++/toml.h>

#include <array>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

// Reads a file. Throws InputError when the file cannot be read or is not TOML.
toml::table parse_toml(const std::string& file);

// A table of the file; `name` is "" for the top level.
class SceneTable {
 public:
  SceneTable(const toml::table& table, std::string name, std::string file)
      : table_(&table), name_(std::move(name)), file_(std::move(file)) {}

  // Throws InputError at the first key that is not in `known`.
  void allow(std::initializer_list<std::string_view> known) const;

  bool has(std::string_view key) const { return table_->contains(key); }

  // Returns the table under `key`, or an empty table.
  SceneTable table(std::string_view key) const;

  // These functions return nullopt where the key is absent, and throw InputError for a wrong type or range.
  std::optional<std::string> string(std::string_view key) const;
  std::optional<double> number_above_zero(std::string_view key) const;
  std::optional<double> number_from_zero(std::string_view key) const;
  std::optional<int> integer(std::string_view key, int least, int most) const;
  std::optional<bool> boolean(std::string_view key) const;
  std::optional<bool> boolean_or_auto(std::string_view key) const;  // nullopt also for "auto"
  std::optional<std::vector<int>> integers(std::string_view key, const char* expected) const;
  std::optional<std::array<double, 3>> vector(std::string_view key) const;

  // Returns the index of the string in `choices`. The message of InputError lists the choices.
  std::optional<std::size_t> choice(std::string_view key, const std::vector<std::string>& choices) const;

  bool is_string(std::string_view key) const;

  // Returns the key with the table's name: "contact.sites".
  std::string path(std::string_view key) const;

  // Throws InputError "file:line: message" at the line of `key`, or of the table where the key is absent.
  [[noreturn]] void fail(std::string_view key, const std::string& message) const;

 private:
  const toml::node* find(std::string_view key) const { return table_->get(key); }
  [[noreturn]] void fail_type(std::string_view key, const std::string& expected) const;
  std::optional<double> finite_number(std::string_view key, const std::string& expected) const;

  const toml::table* table_;
  std::string name_;
  std::string file_;
};

}  // namespace palpate
