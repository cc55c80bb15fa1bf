// Splits an .inp file into keyword lines with parameters and data lines with fields, and opens its *INCLUDEs
// in place. inp_reader.cpp gives keywords their meaning.
//
//   ** a comment
//   *ELEMENT, TYPE=C3D4,        <- keyword line; the trailing comma continues it
//      ELSET = Eall
//   1, 10, 11, 12, 13           <- data line of *ELEMENT
//   *INCLUDE, INPUT=more.inc    <- its lines follow here, and may begin with data lines of *ELEMENT
#pragma once

#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "offline/mesh/input_error.hpp"
#include "offline/mesh/source_place.hpp"

namespace palpate {

struct Parameter {
  std::string name;                  // normalised, blanks removed: "NEOHOOKE"
  std::string shown;                 // for messages: "NEO HOOKE"
  std::optional<std::string> value;  // as written, without surrounding blanks; none for a bare parameter
};

struct KeywordLine {
  std::string name;   // normalised, blanks removed: "SOLIDSECTION"
  std::string shown;  // for messages: "*SOLID SECTION"
  std::vector<Parameter> parameters;
  Place place;

  const Parameter* find(std::string_view parameter) const;
};

struct DataLine {
  std::string_view text;                 // the whole line, trimmed
  std::vector<std::string_view> fields;  // between commas, trimmed; "1,2," has three, the last empty
  Place place;
};

// A refusal that an earlier refusal can cause, such as an unknown set whose *NSET was refused. It is reported
// only where it is the first.
class FollowingError : public InputError {
 public:
  using InputError::InputError;
};

class InpLexer {
 public:
  // Opens the model file. All files must lie below `include_root`. If `include_root` is empty, included files
  // must lie below the folder of the model file. Throws InputError when a file cannot be read.
  InpLexer(const std::filesystem::path& file, const std::filesystem::path& include_root);
  ~InpLexer();

  // Skips remaining data lines and returns the next keyword line; null at the end of the model. An *INCLUDE
  // that fails ends the model.
  const KeywordLine* next_keyword();

  // Returns the next data line of the keyword; null at another keyword or the end. Valid until the next call.
  const DataLine* next_data();

  const SourceFiles& files() const { return files_; }

  // Throws InputError at `place`: "file:line: message".
  [[noreturn]] void fail(Place place, const std::string& message) const;

  // Throws FollowingError at `place`.
  [[noreturn]] void fail_following(Place place, const std::string& message) const;

  // Refuses the use of `name`, which is not defined: with FollowingError where a refused keyword gives it.
  [[noreturn]] void fail_unknown(Place place, const std::string& name, const std::string& message) const;

  // Remembers the names that a refused keyword gives.
  void note_refused(const KeywordLine& keyword);

  // Refuses parameters of `keyword` outside of `known`, and repeated parameters.
  void allow_parameters(const KeywordLine& keyword, std::span<const std::string_view> known) const;
  void allow_parameters(const KeywordLine& keyword, std::initializer_list<std::string_view> known) const {
    allow_parameters(keyword, std::span(known.begin(), known.size()));
  }

  // Returns the value of a required, non-empty parameter.
  std::string required_value(const KeywordLine& keyword, std::string_view parameter) const;

 private:
  enum class Kind { unread, keyword, data, end };
  struct OpenFile;

  void open(const std::filesystem::path& file, Place named_at);
  void include(const KeywordLine& keyword);
  bool next_line(std::string_view& line, Place& place);
  bool peek_line(std::string_view& line);
  void advance();
  void read_keyword(std::string_view line, Place place);
  void read_data(std::string_view line, Place place);

  std::filesystem::path include_root_;  // canonical folder
  bool model_must_be_below_;
  SourceFiles files_;
  std::vector<std::unique_ptr<OpenFile>> open_;  // the innermost *INCLUDE is last
  int num_opened_ = 0;
  std::size_t bytes_left_;  // of kMaxModelBytes, for all files together
  std::set<std::string> refused_names_;
  bool nameless_refused_ = false;  // a refused keyword has no name, and may have been meant to give any
  Kind kind_ = Kind::unread;       // of the line that advance() has read ahead
  KeywordLine keyword_;
  KeywordLine returned_keyword_;
  DataLine data_;
};

}  // namespace palpate
