// The lines of an .inp file, its *INCLUDEs opened in place: keyword lines with their parameters, data lines
// with their fields. What a keyword means is inp_reader.cpp's business.
//
//   ** a comment
//   *ELEMENT, TYPE=C3D4,        <- keyword line; the trailing comma continues it
//      ELSET = Eall
//   1, 10, 11, 12, 13           <- data line of *ELEMENT
//   *INCLUDE, INPUT=more.inc    <- its lines follow here, data lines of *ELEMENT if it begins with such
#pragma once

#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "offline/mesh/source_place.hpp"

namespace palpate {

struct Parameter {
  std::string name;                  // normalised, blanks removed: "NEOHOOKE"
  std::string shown;                 // for messages: "NEO HOOKE"
  std::optional<std::string> value;  // as written, blanks around it removed; none for a bare parameter
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

class InpLexer {
 public:
  // Opens the model file. Throws InputError when it cannot be read.
  explicit InpLexer(const std::filesystem::path& file);
  ~InpLexer();

  // Passes the data lines left over and returns the next keyword line; null at the end of the model.
  const KeywordLine* next_keyword();

  // The next data line of the keyword; null when another keyword or the end follows. Valid until the next
  // call.
  const DataLine* next_data();

  const SourceFiles& files() const { return files_; }

  // Throws InputError at `place`: "file:line: message".
  [[noreturn]] void fail(Place place, const std::string& message) const;

  // Refuses the parameters of `keyword` that are not in `known`, and those given twice.
  void allow_parameters(const KeywordLine& keyword, std::span<const std::string_view> known) const;
  void allow_parameters(const KeywordLine& keyword, std::initializer_list<std::string_view> known) const {
    allow_parameters(keyword, std::span(known.begin(), known.size()));
  }

  // The value of a parameter that must be there and must not be empty.
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

  SourceFiles files_;
  std::vector<std::unique_ptr<OpenFile>> open_;  // the innermost *INCLUDE last
  int num_opened_ = 0;
  Kind kind_ = Kind::unread;
  KeywordLine keyword_;
  KeywordLine returned_keyword_;
  DataLine data_;
};

}  // namespace palpate
