#include "offline/mesh/inp_lexer.hpp"

#include <algorithm>
#include <system_error>
#include <utility>

#include "offline/mesh/inp_remedies.hpp"
#include "offline/mesh/text_file.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// This depth exceeds the nesting of any model, and bounds a chain of generated files.
constexpr std::size_t kDeepestInclude = 32;
// This number exceeds the files of any model, and bounds files that include others repeatedly.
constexpr int kMostIncludes = 10000;
// A field takes more memory than its letters.
constexpr std::ptrdiff_t kMostFields = 10000;
constexpr std::size_t kLongestKeyword = 100000;  // bytes

bool is_comment(std::string_view line) {
  return line.substr(0, 2) == "**";
}

// Splits at commas outside of double quotes.
void split_fields(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  std::size_t begin = 0;
  bool quoted = false;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    if (i < line.size() && line[i] == '"') quoted = !quoted;
    if (i == line.size() || (line[i] == ',' && !quoted)) {
      fields.push_back(trimmed(line.substr(begin, i - begin)));
      begin = i + 1;
    }
  }
}

// Whether a canonical path lies in a canonical folder, at any depth.
bool is_below(const std::filesystem::path& folder, const std::filesystem::path& path) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

// Returns `mark` and the words in upper case: "Solid  section" -> "SOLID SECTION".
std::string shown_words(std::string_view text, std::string_view mark = {}) {
  std::string shown(mark);
  bool blank = false;
  for (const char c : text) {
    if (c == ' ' || c == '\t') {
      blank = shown.size() > mark.size();
      continue;
    }
    if (blank) shown += ' ';
    blank = false;
    shown += normalised_name(std::string_view(&c, 1));
  }
  return printable(shown);
}

}  // namespace

struct InpLexer::OpenFile {
  std::filesystem::path path;
  std::filesystem::path canonical;
  std::string content;
  std::size_t next = 0;  // offset of the next line
  Place place;           // place of the last line
};

const Parameter* KeywordLine::find(std::string_view parameter) const {
  for (const Parameter& candidate : parameters) {
    if (candidate.name == parameter) return &candidate;
  }
  return nullptr;
}

InpLexer::InpLexer(const std::filesystem::path& file, const std::filesystem::path& include_root)
    : model_must_be_below_(!include_root.empty()), bytes_left_(kMaxModelBytes) {
  std::error_code error;
  std::filesystem::path root = include_root;
  if (root.empty()) root = std::filesystem::absolute(file, error).parent_path();
  if (!error) include_root_ = std::filesystem::weakly_canonical(root, error);
  if (error) throw InputError({file.string(), 0}, "its folder cannot be resolved: " + error.message());
  open(file, {});
}

InpLexer::~InpLexer() = default;

void InpLexer::fail(Place place, const std::string& message) const {
  throw InputError(files_.at(place), message);
}

void InpLexer::fail_following(Place place, const std::string& message) const {
  throw FollowingError(files_.at(place), message);
}

void InpLexer::fail_unknown(Place place, const std::string& name, const std::string& message) const {
  const std::string instance = name.substr(0, name.rfind('.'));  // of "LIVER-1.BASE"
  if (nameless_refused_ || refused_names_.count(name) > 0 || refused_names_.count(instance) > 0)
    fail_following(place, message);
  fail(place, message);
}

void InpLexer::note_refused(const KeywordLine& keyword) {
  bool named = false;
  for (const Parameter& parameter : keyword.parameters) {
    if (!parameter.value) continue;
    named = true;
    refused_names_.insert(normalised_name(*parameter.value));
  }
  if (!named) nameless_refused_ = true;
}

void InpLexer::open(const std::filesystem::path& file, Place named_at) {
  const bool included = !open_.empty();
  const auto refuse = [&](const std::string& reason) {
    if (included) fail(named_at, "*INCLUDE of " + printable(file.string()) + ": " + reason);
    throw InputError({file.string(), 0}, reason);
  };
  std::error_code error;
  auto opened = std::make_unique<OpenFile>();
  opened->path = file;
  // weakly_canonical() leaves the path of a missing file relative.
  opened->canonical = std::filesystem::absolute(file, error);
  if (!error) opened->canonical = std::filesystem::weakly_canonical(opened->canonical, error);
  if (error) refuse("cannot be resolved (" + error.message() + "); check its name");
  for (const auto& outer : open_) {
    if (outer->canonical == opened->canonical) refuse("the file includes itself; break the circle");
  }
  if ((included || model_must_be_below_) && !is_below(include_root_, opened->canonical)) {
    refuse("the file is outside of " + printable(include_root_.string()) +
           "; move it there, or trust the model with --allow-outside");
  }
  if (open_.size() >= kDeepestInclude) {
    refuse("files are nested more than " + std::to_string(kDeepestInclude) + " deep; flatten them");
  }
  if (++num_opened_ > kMostIncludes)
    refuse("more than " + std::to_string(kMostIncludes) + " files are included");
  const std::string unreadable = read_text_file(opened->canonical, opened->content);
  if (!unreadable.empty()) refuse(unreadable);
  if (opened->content.size() > bytes_left_)
    refuse("the files of this model are together larger than " + std::to_string(kMaxModelBytes) +
           " bytes, the limit; name smaller files");
  if (opened->content.empty() && !included) refuse("is empty; copy or export it again");
  bytes_left_ -= opened->content.size();
  if (opened->content.rfind("\xEF\xBB\xBF", 0) == 0) opened->next = 3;  // a UTF-8 byte order mark
  opened->place.file = files_.add(file.string());
  open_.push_back(std::move(opened));
}

void InpLexer::include(const KeywordLine& keyword) {
  allow_parameters(keyword, {"INPUT"});
  std::filesystem::path path = unquoted(required_value(keyword, "INPUT"));
  // Relative to the including file, so that a model reads from any working directory.
  if (path.is_relative()) path = open_.back()->path.parent_path() / path;
  open(path, keyword.place);
}

// Reads the next line of the innermost file, trimmed; skips blank lines and comments.
bool InpLexer::next_line(std::string_view& line, Place& place) {
  OpenFile& file = *open_.back();
  while (file.next < file.content.size()) {
    const std::size_t end = std::min(file.content.find('\n', file.next), file.content.size());
    line = trimmed(std::string_view(file.content).substr(file.next, end - file.next));
    file.next = end + 1;
    ++file.place.line;
    place = file.place;
    if (!line.empty() && !is_comment(line)) return true;
  }
  return false;
}

bool InpLexer::peek_line(std::string_view& line) {
  OpenFile& file = *open_.back();
  const std::size_t next = file.next;
  const Place last = file.place;
  Place ignored;
  const bool found = next_line(line, ignored);
  file.next = next;
  file.place = last;
  return found;
}

// Reads ahead to the next keyword or data line. Opens included files on the way.
void InpLexer::advance() {
  while (!open_.empty()) {
    std::string_view line;
    Place place;
    if (!next_line(line, place)) {
      open_.pop_back();
      continue;
    }
    if (line.front() != '*') {
      read_data(line, place);
      kind_ = Kind::data;
      return;
    }
    read_keyword(line, place);
    if (keyword_.name == "INCLUDE") {
      try {
        include(keyword_);
      } catch (const InputError&) {
        // Without the included lines, most that follows would be refused.
        open_.clear();
        throw;
      }
      continue;
    }
    kind_ = Kind::keyword;
    return;
  }
  kind_ = Kind::end;
}

void InpLexer::read_keyword(std::string_view line, Place place) {
  std::string whole(line.substr(1, kLongestKeyword + 1));
  std::string_view continuation;
  while (whole.ends_with(',') && peek_line(continuation) && continuation.front() != '*') {
    Place ignored;
    next_line(continuation, ignored);
    whole += continuation;
    if (whole.size() > kLongestKeyword) break;
  }
  if (whole.size() > kLongestKeyword)
    fail(place, "a keyword has more than " + std::to_string(kLongestKeyword) + " bytes; write it anew");
  std::vector<std::string_view> fields;
  split_fields(whole, fields);
  keyword_ = KeywordLine();
  keyword_.name = normalised_name(fields[0]);
  keyword_.shown = shown_words(fields[0], "*");
  keyword_.place = place;
  for (std::size_t i = 1; i < fields.size(); ++i) {
    if (fields[i].empty()) continue;
    const std::size_t equals = fields[i].find('=');
    Parameter parameter;
    parameter.name = normalised_name(fields[i].substr(0, equals));
    parameter.shown = shown_words(fields[i].substr(0, equals));
    if (equals != std::string_view::npos) parameter.value = trimmed(fields[i].substr(equals + 1));
    keyword_.parameters.push_back(std::move(parameter));
  }
}

void InpLexer::read_data(std::string_view line, Place place) {
  data_.text = line;
  data_.place = place;
  if (std::ranges::count(line, ',') >= kMostFields)
    fail(place, "the line has more than " + std::to_string(kMostFields) + " fields; break it");
  split_fields(line, data_.fields);
}

const KeywordLine* InpLexer::next_keyword() {
  while (next_data() != nullptr) {
  }
  if (kind_ == Kind::end) return nullptr;
  kind_ = Kind::unread;
  returned_keyword_ = std::move(keyword_);
  return &returned_keyword_;
}

const DataLine* InpLexer::next_data() {
  if (kind_ == Kind::unread) advance();
  if (kind_ != Kind::data) return nullptr;
  kind_ = Kind::unread;
  return &data_;
}

void InpLexer::allow_parameters(const KeywordLine& keyword, std::span<const std::string_view> known) const {
  for (const Parameter& parameter : keyword.parameters) {
    const std::string shown = keyword.shown + ", " + parameter.shown;
    if (std::find(known.begin(), known.end(), parameter.name) == known.end()) {
      fail(keyword.place, shown + " is not supported" + parameter_remedy(keyword, parameter, known));
    }
    if (keyword.find(parameter.name) != &parameter) {
      fail(keyword.place, shown + " is given twice; keep one");
    }
  }
}

std::string InpLexer::required_value(const KeywordLine& keyword, std::string_view parameter) const {
  const Parameter* found = keyword.find(parameter);
  if (found == nullptr || !found->value || found->value->empty()) {
    fail(keyword.place, keyword.shown + " needs " + std::string(parameter) + "=...; add it");
  }
  return *found->value;
}

}  // namespace palpate
