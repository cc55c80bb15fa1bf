#include "offline/mesh/inp_fields.hpp"

#include <algorithm>
#include <limits>

#include "offline/mesh/nearest_name.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {

FieldReader::FieldReader(const InpLexer& lexer, const DataLine& line, std::size_t least, std::size_t most,
                         const std::string& layout)
    : lexer_(lexer), line_(line) {
  std::size_t count = line.fields.size();
  while (count > most && line.fields[count - 1].empty()) --count;
  if (count < least || count > most) {
    lexer.fail(line.place, "expected " + layout + ", found " + std::to_string(count) +
                               (count == 1 ? " field" : " fields") + "; correct the line");
  }
}

std::string_view FieldReader::text(std::size_t field) const {
  return field < line_.fields.size() ? line_.fields[field] : std::string_view();
}

double FieldReader::number(std::size_t field) const {
  return number(field, 0.0);
}

double FieldReader::number(std::size_t field, double fallback) const {
  if (is_empty(field)) return fallback;
  const std::optional<double> value = parse_number(text(field));
  if (!value) lexer_.fail(line_.place, "'" + printable(text(field)) + "' is not a finite number; correct it");
  return *value;
}

int FieldReader::integer(std::size_t field, const char* meaning) const {
  const std::optional<int> value = parse_integer(text(field));
  if (!value) {
    lexer_.fail(line_.place,
                "'" + printable(text(field)) + "' is not a " + meaning + "; write a whole number");
  }
  return *value;
}

int FieldReader::label(std::size_t field, const char* meaning) const {
  const int value = integer(field, meaning);
  if (value <= 0) {
    lexer_.fail(line_.place, std::to_string(value) + " is not a " + meaning + "; labels begin at 1");
  }
  return value;
}

int FieldReader::axis(std::size_t field) const {
  const int dof = integer(field, "degree of freedom");
  if (dof < 1 || dof > 3) {
    lexer_.fail(line_.place, "degree of freedom " + std::to_string(dof) +
                                 " does not exist in a solid; write 1 (x), 2 (y) or 3 (z)");
  }
  return dof - 1;
}

DraftTarget FieldReader::label_or_set(std::size_t field, const Draft& draft, const DraftSets& sets,
                                      const char* item) const {
  DraftTarget target;
  if (!is_name(text(field))) {
    target.label = label(field, (std::string(item) + " label").c_str());
    return target;
  }
  const std::string name = normalised_name(text(field));
  const std::size_t dot = name.rfind('.');
  if (dot != std::string::npos && sets.find(name) < 0) {
    const auto instance = draft.assembly.label_offsets.find(name.substr(0, dot));
    const std::optional<int> label = parse_integer(std::string_view(name).substr(dot + 1));
    if (instance != draft.assembly.label_offsets.end() && label && *label > 0) {
      target.label = shifted_label(*label, instance->second);
      return target;
    }
  }
  target.set = known_set(lexer_, sets, (std::string(item) + " set").c_str(), text(field), line_.place);
  return target;
}

DraftTarget FieldReader::node_or_set(std::size_t field, const Draft& draft) const {
  return label_or_set(field, draft, draft.node_sets, "node");
}

DraftTarget FieldReader::element_or_set(std::size_t field, const Draft& draft) const {
  return label_or_set(field, draft, draft.element_sets, "element");
}

bool is_name(std::string_view field) {
  if (field.empty()) return false;
  const char c = field.front();
  return !((c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.');
}

int shifted_label(int label, int offset) {
  return label > std::numeric_limits<int>::max() - offset ? std::numeric_limits<int>::max() : label + offset;
}

int known_set(const InpLexer& lexer, const DraftSets& sets, const char* kind, std::string_view name,
              Place place) {
  const std::string normalised = normalised_name(name);
  const int set = sets.find(normalised);
  if (set < 0) {
    lexer.fail_unknown(place, normalised,
                       std::string(kind) + " " + printable(normalised) + " is not defined above this line" +
                           did_you_mean(normalised, sets.names()));
  }
  return set;
}

}  // namespace palpate
